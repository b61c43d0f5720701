// A TypeScript module of the viewer, built in memory: for rules that want no page.

import { resolve } from "node:path";
import { build } from "vite";

export async function source(file) {
  const entry = resolve(import.meta.dirname, "../src", file);
  const lib = { entry, formats: ["es"], fileName: "it" };
  const built = await build({ configFile: false, logLevel: "error", build: { lib, write: false, minify: false } });
  const { code } = built[0].output[0];
  return import(`data:text/javascript;base64,${Buffer.from(code).toString("base64")}`);
}
