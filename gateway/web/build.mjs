// Makes dist/page.js of src/, home/ and operators/. With --check, reports whether the committed file matches the sources, and writes nothing.
import { readFile, writeFile } from "node:fs/promises";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const OUT = new URL("dist/page.js", import.meta.url);
/** Maximum size of the compressed script, so that pages load quickly on telephones. */
const MOST_GZIP_BYTES = 200_000;

const licence = await readFile(new URL("node_modules/three/LICENSE", import.meta.url), "utf8");
const made = await build({
  absWorkingDir: new URL(".", import.meta.url).pathname,
  entryPoints: ["src/main.js"],
  bundle: true,
  minify: true,
  write: false,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  banner: { js: `/* Made of gateway/web by gateway/web/build.mjs; holds three.js:\n${licence.trim()}\n*/` },
});
const [{ contents }] = made.outputFiles;
const gzip = gzipSync(contents, { level: 9 }).length;
console.log(`dist/page.js: ${contents.length} bytes, ${gzip} with gzip`);
if (gzip > MOST_GZIP_BYTES) {
  console.error(`more than ${MOST_GZIP_BYTES} bytes with gzip`);
  process.exit(1);
}
if (process.argv.includes("--check")) {
  const committed = await readFile(OUT);
  if (Buffer.compare(committed, Buffer.from(contents)) !== 0) {
    console.error("dist/page.js is not what the sources give; run `npm run build` in gateway/web and commit it");
    process.exit(1);
  }
} else {
  await writeFile(OUT, contents);
}
