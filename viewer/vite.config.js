import { defineConfig } from "vite";

/**
 * The worker runs the viewer's own script once more: a page from disk has no file to start it from, and
 * the libraries inside a second time would be 55 kB more (gzip). The script is one function, whose text
 * is the worker's. A script tag with `data-worker="file"` has it started from its own file instead, which
 * the browser keeps compiled: for pages whose content policy allows that.
 */
const workerIsItself = {
  name: "worker-is-itself",
  enforce: "pre",
  resolveId: (id) => (id.endsWith("/worker?worker&inline") ? "\0itself" : null),
  load: (id) => (id === "\0itself" ? "let url; export default function () { return new Worker(url ??= wallTopoUrl()); }" : null),
  generateBundle(_, bundle) {
    for (const chunk of Object.values(bundle)) {
      // Where there is no page there is no HTMLElement to extend.
      const bare = "self.HTMLElement??=class{};";
      const file = 'const wallTopoTag=self.document?.currentScript,wallTopoFile=wallTopoTag?.dataset.worker==="file"&&wallTopoTag.src;';
      const blob = 'URL.createObjectURL(new Blob(["(",String(wallTopo),")()"],{type:"text/javascript"}))';
      chunk.code = `(function wallTopo(){${bare}${file}const wallTopoUrl=()=>wallTopoFile||${blob};${chunk.code}})();\n`;
    }
  },
};

// One classic script: a page opened from disk may not load module scripts.
export default defineConfig({
  plugins: [workerIsItself],
  build: {
    target: "es2022",
    outDir: "../src/walltopo/publish/page",
    emptyOutDir: false,
    copyPublicDir: false,
    lib: {
      entry: "src/page.ts",
      formats: ["iife"],
      name: "WallTopoViewer",
      fileName: () => "viewer.js",
    },
  },
});
