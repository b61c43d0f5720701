import { defineConfig } from "vite";

// The npm package: a module whose libraries stay the consumer's own, so that there is one three.js.
export default defineConfig({
  build: {
    target: "es2022",
    outDir: "dist",
    copyPublicDir: false,
    sourcemap: true,
    minify: false,
    lib: { entry: "src/index.ts", formats: ["es"], fileName: () => "wall-topo.js" },
    rolldownOptions: { external: [/^three($|\/)/, "three-mesh-bvh", "camera-controls"] },
  },
});
