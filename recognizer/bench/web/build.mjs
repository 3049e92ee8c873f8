// The page: src/ -> ../static, the same bytes for the same sources.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { copyFileSync, mkdirSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";

const out = new URL("../static/", import.meta.url).pathname;
rmSync(out, { recursive: true, force: true });
mkdirSync(out);
await build({
  entryPoints: ["src/main.ts", "src/style.css"],
  outdir: out,
  entryNames: "[name]",
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  logLevel: "info",
});
for (const name of ["index.html", "icon.svg"]) copyFileSync(`src/${name}`, out + name);
copyFileSync("node_modules/three/LICENSE", out + "three-licence.txt");

// Which sources these are of: a test compares both sides, so that neither is changed alone.
const sum = (path) => createHash("sha256").update(readFileSync(path)).digest("hex");
const sums = (folder) => Object.fromEntries(readdirSync(folder).sort().map((name) => [name, sum(folder + name)]));
const built = { sources: { ...sums("src/"), "package-lock.json": sum("package-lock.json"), "build.mjs": sum("build.mjs") }, page: sums(out) };
writeFileSync(out + "built.json", JSON.stringify(built, null, 1) + "\n");
