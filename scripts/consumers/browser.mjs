// Chromium for the tests: launched without any network of its own, pictures as PNG files.

import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

// The packages lie where setup-consumers put them: in the folder that the test runs this in.
export const modules = join(process.cwd(), "node_modules");
const { chromium } = createRequire(join(modules, "x.js"))("playwright-core");

const FLAGS = [
  "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic",
  "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
];

// Runs `work(tab)` in a fresh profile; what the page logs goes to stderr, errors of the page fail.
export async function withTab(size, work) {
  const profile = mkdtempSync(join(tmpdir(), "chromium-"));
  // setup-consumers links the browser that it found.
  const executablePath = join(process.cwd(), "chromium");
  const browser = await chromium.launchPersistentContext(profile, { executablePath, headless: true, args: FLAGS, viewport: size });
  try {
    const tab = await browser.newPage();
    const errors = [];
    tab.on("console", (message) => console.error(`page: ${message.text()}`));
    tab.on("pageerror", (error) => {
      console.error(`error of the page: ${error.message}`);
      errors.push(error.message);
    });
    const result = await work(tab);
    if (errors.length) throw new Error(`errors of the page: ${errors.join("; ")}`);
    return result;
  } finally {
    await browser.close();
    rmSync(profile, { recursive: true, force: true });
  }
}

// `data:image/png;base64,...` to a file.
export function savePng(path, url) {
  writeFileSync(path, Buffer.from(url.split(",")[1], "base64"));
}
