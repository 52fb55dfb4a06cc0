// Bundles the page into a folder: index.html, app.js, app.css, icon.svg, and a .gz of each.
//   node build.mjs [FOLDER]     default: build/web at the project's root
// The same sources and lockfile give the same bytes: no time, no path and no host is in them.
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const folder = resolve(process.argv[2] ?? join(here, "../../../build/web"));
const kMostBytes = 150 * 1024; // gzipped, in all: a page of a slow link in a hutch

const bundle = await build({
  absWorkingDir: here,
  entryPoints: { app: "src/main.ts" },
  bundle: true,
  minify: true,
  format: "iife",
  target: ["chrome109", "firefox115", "safari16"],
  outdir: folder,
  write: false,
  legalComments: "inline",
  logLevel: "warning",
});

const files = new Map(
  bundle.outputFiles.map((file) => [file.path.slice(folder.length + 1), Buffer.from(file.contents)]),
);
for (const name of ["index.html", "icon.svg"]) {
  files.set(name, await readFile(join(here, "src", name)));
}

await mkdir(folder, { recursive: true });
let total = 0;
for (const [name, bytes] of files) {
  const packed = gzipSync(bytes, { level: 9 });
  packed[9] = 255; // the byte of the operating system differs between builds of zlib
  total += packed.length;
  await writeFile(join(folder, name), bytes);
  await writeFile(join(folder, `${name}.gz`), packed);
}
console.log(`${folder}: ${files.size} files, ${total} bytes gzipped`);
if (total > kMostBytes) {
  console.error(`${total} bytes gzipped; allowed: ${kMostBytes}. Look for what has grown`);
  process.exit(1);
}
