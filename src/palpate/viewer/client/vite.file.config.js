// The script of a page that is one file, as one plain script: a page from disk may load no modules.

import { join } from "node:path";
import { defineConfig } from "vite";

export default defineConfig({
  build: {
    outDir: "../static",
    emptyOutDir: false,
    copyPublicDir: false,
    target: "es2022",
    cssCodeSplit: false,
    lib: {
      entry: join(import.meta.dirname, "src/file.ts"),
      formats: ["iife"],
      name: "palpateFile",
      fileName: () => "assets/file.js",
    },
  },
});
