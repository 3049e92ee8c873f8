// The page: src/ -> ../static, the same bytes for the same sources.
import { build } from "esbuild";
import { copyFileSync, mkdirSync, rmSync } from "node:fs";

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
