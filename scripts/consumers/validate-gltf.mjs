// node validate-gltf.mjs FILE...
// The Khronos validator on binary glTF files. Prints its errors and warnings, and fails when there is an error.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const validator = createRequire(join(process.cwd(), "node_modules", "x.js"))("gltf-validator");
let errors = 0;
for (const path of process.argv.slice(2)) {
  const { issues } = await validator.validateBytes(new Uint8Array(readFileSync(path)), { maxIssues: 100 });
  errors += issues.numErrors;
  const serious = issues.messages.filter((message) => message.severity < 2);
  for (const message of serious) console.log(`${path}: ${message.code} ${message.pointer ?? ""} ${message.message}`);
  console.log(`${path}: ${issues.numErrors} errors, ${issues.numWarnings} warnings`);
}
process.exitCode = errors ? 1 : 0;
