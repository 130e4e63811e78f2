import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { defineConfig } from "vite";

const here = import.meta.dirname;

/** Names of the files that the bundle is made of; the tests compare their digest with the bundle's. */
function sources() {
  const inside = (folder) => readdirSync(join(here, folder)).map((name) => `${folder}/${name}`);
  const own = ["index.html", "package-lock.json", "package.json", "tsconfig.json", "vite.config.js"];
  return [...own, ...inside("public"), ...inside("src")].sort();
}

/** Writes which sources a bundle was built from. */
function stamp() {
  return {
    name: "stamp",
    generateBundle() {
      const digest = createHash("sha256");
      for (const name of sources()) {
        digest.update(`${name}\n${readFileSync(join(here, name), "utf8").replaceAll("\r\n", "\n")}\n`);
      }
      this.emitFile({ type: "asset", fileName: "sources.sha256", source: `${digest.digest("hex")}\n` });
    },
  };
}

export default defineConfig({
  base: "./",
  plugins: [stamp()],
  worker: {
    format: "es",
    rollupOptions: { output: { entryFileNames: "assets/[name].js" } },
  },
  build: {
    outDir: "../static",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      // these stay modules of their own, whole, so that tests can speak through them
      input: {
        page: join(here, "index.html"),
        file: join(here, "src/file.ts"),
        messages: join(here, "src/messages.ts"),
        field: join(here, "src/field.ts"),
        gamepad: join(here, "src/gamepad.ts"),
        units: join(here, "src/units.ts"),
      },
      preserveEntrySignatures: "strict",
      output: {
        // plain names: the files are under version control and the server forbids stale copies
        entryFileNames: "assets/[name].js",
        chunkFileNames: "assets/[name].js",
        assetFileNames: "assets/[name][extname]",
        // a chunk of its own, which stays as it is while the page's own code changes
        codeSplitting: { groups: [{ name: "three", test: /node_modules/ }] },
      },
    },
  },
});
