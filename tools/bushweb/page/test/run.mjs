// Types, then all tests: bundled into a folder of its own, as node 18 reads no TypeScript.
import { spawnSync } from "node:child_process";
import { mkdtemp, readdir, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const run = (args) => spawnSync(process.execPath, args, { cwd: join(here, ".."), stdio: "inherit" }).status ?? 1;

const untyped = run(["node_modules/typescript/bin/tsc", "--noEmit"]);
let failed = 1;
const folder = await mkdtemp(join(tmpdir(), "bushweb-page-"));
try {
  const names = (await readdir(here)).filter((name) => name.endsWith(".test.ts"));
  await build({
    absWorkingDir: here, entryPoints: names, outdir: folder, outExtension: { ".js": ".mjs" },
    bundle: true, format: "esm", platform: "node", target: "node18", logLevel: "warning",
  });
  failed = run(["--test", ...names.map((name) => join(folder, name.replace(/\.ts$/, ".mjs")))]);
} finally {
  await rm(folder, { recursive: true });
}
process.exitCode = untyped || failed;
