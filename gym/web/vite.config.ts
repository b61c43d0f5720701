import { svelte } from "@sveltejs/vite-plugin-svelte";
import { createHash } from "node:crypto";
import { build, defineConfig, type Plugin } from "vite";

/** The service worker with the list of what the shell is made of, and a name for that list. */
const serviceWorker: Plugin = {
  name: "service-worker",
  async generateBundle(_, bundle) {
    const shell = Object.keys(bundle)
      .filter((name) => /\.(js|css)$/.test(name))
      .sort()
      .map((name) => `/${name}`);
    const worker = await bundled("src/offline/service-worker.js");
    const version = createHash("sha256").update(shell.join() + worker).digest("hex").slice(0, 12);
    const told = `const SHELL = ${JSON.stringify(shell)};\nconst VERSION = "${version}";\n`;
    this.emitFile({ type: "asset", fileName: "sw.js", source: told + worker });
  },
};

/** In one classic script: not every browser runs modules as service workers, and modules wait for the page. */
async function bundled(input: string): Promise<string> {
  const made = await build({
    configFile: false,
    logLevel: "warn",
    build: { target: "es2022", write: false, rollupOptions: { input, output: { format: "iife" } } },
  });
  if (Array.isArray(made) || !("output" in made)) throw new Error(`${input}: expected one bundle`);
  return made.output[0].code;
}

const MARK = "<!--head-->";

/** `walls/early.ts` as the page's first script, which waits for none of the app's. */
const early: Plugin = {
  name: "early",
  apply: "build",
  async buildStart() {
    this.emitFile({ type: "asset", name: "early.js", source: await bundled("src/walls/early.ts") });
  },
  transformIndexHtml: {
    order: "post",
    handler(page, { bundle }) {
      const file = Object.values(bundle ?? {}).find((made) => made.type === "asset" && made.names.includes("early.js"));
      if (!file) throw new Error("early.js was not made");
      // After the mark that the server replaces, as that says where the viewer is; before styles, which it would wait for.
      return page.replace(MARK, `${MARK}<script src="/${file.fileName}"></script>`);
    },
  },
};

const SERVER = "http://127.0.0.1:8080";

/** In development, what the server would write into the page's head: features, and where the viewer is. */
const head: Plugin = {
  name: "head",
  apply: "serve",
  async transformIndexHtml(page, { originalUrl }) {
    const theirs = await (await fetch(SERVER + (originalUrl ?? "/"))).text();
    const metas = theirs.match(/<meta name="(wall-viewer|features)"[^>]*>/g) ?? [];
    return page.replace(MARK, metas.join(""));
  },
};

export default defineConfig({
  plugins: [svelte(), early, head, serviceWorker],
  build: {
    target: "es2022",
    rollupOptions: {
      // What pages share comes in one file and not in twenty: each costs a slow phone some hundredths of a second.
      output: { codeSplitting: { groups: [{ name: "common", test: /\/src\/(lib|walls|shell|offline|outbox)\//, minShareCount: 2 }] } },
    },
    outDir: "../src/walltopo_gym/web",
    emptyOutDir: true,
    assetsInlineLimit: 0,
    // The page's policy knows no inline script.
    modulePreload: { polyfill: false },
  },
  server: { proxy: { "/api": SERVER, "/assets": SERVER } },
});
