import { defineConfig } from "vite";

// One page, one script with its chunks, one style sheet; names without hashes, because the server embeds them.
const names = { entryFileNames: "[name].js", chunkFileNames: "[name].js", assetFileNames: "[name][extname]" };

export default defineConfig({
  base: "./",
  build: {
    outDir: process.env["WAYMARK_VIEWER_OUT"] ?? "../build/viewer/dist",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    chunkSizeWarningLimit: 1500,
    rollupOptions: { output: { ...names, entryFileNames: "app.js" } },
  },
  worker: { format: "es", rollupOptions: { output: names } },
  test: { include: ["src/**/*.test.ts"] },
} as import("vite").UserConfig & { test: unknown });
