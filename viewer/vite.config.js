import { defineConfig } from "vite";

// One classic script: a page opened from disk may not load module scripts.
export default defineConfig({
  build: {
    target: "es2022",
    outDir: "../src/walltopo/export/page",
    emptyOutDir: false,
    copyPublicDir: false,
    lib: {
      entry: "src/main.ts",
      formats: ["iife"],
      name: "WallTopoViewer",
      fileName: () => "viewer.js",
    },
  },
});
