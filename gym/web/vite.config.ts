import { svelte } from "@sveltejs/vite-plugin-svelte";
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { defineConfig, type Plugin } from "vite";

/** The service worker with the list of what the shell is made of, and a name for that list. */
const serviceWorker: Plugin = {
  name: "service-worker",
  generateBundle(_, bundle) {
    const shell = Object.keys(bundle)
      .filter((name) => /\.(js|css)$/.test(name))
      .sort()
      .map((name) => `/${name}`);
    const version = createHash("sha256").update(shell.join()).digest("hex").slice(0, 12);
    const told = `const SHELL = ${JSON.stringify(shell)};\nconst VERSION = "${version}";\n`;
    const source = told + readFileSync("src/service-worker.js", "utf8");
    this.emitFile({ type: "asset", fileName: "sw.js", source });
  },
};

export default defineConfig({
  plugins: [svelte(), serviceWorker],
  build: {
    target: "es2022",
    outDir: "../src/walltopo_gym/web",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    // The page's policy knows no inline script.
    modulePreload: { polyfill: false },
  },
  server: { proxy: { "/api": "http://127.0.0.1:8080" } },
});
