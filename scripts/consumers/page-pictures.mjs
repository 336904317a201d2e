// node page-pictures.mjs PAGE.html FOLDER VIEW MODE...
// Opens a page of `export --html` from file:// and saves FOLDER/MODE.png, the view in each mode at the
// photo's size, and FOLDER/screen.png, what a visitor sees. Prints a line of JSON.

import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { savePng, withTab } from "./browser.mjs";

const [page, folder, view, ...modes] = process.argv.slice(2);

const report = await withTab({ width: 800, height: 600 }, async (tab) => {
  const requests = [];
  tab.on("request", (request) => requests.push(request.url()));
  const start = Date.now();
  await tab.goto(`${pathToFileURL(resolve(page))}#view=${encodeURIComponent(view)}`);
  await tab.waitForSelector("body.ready, body.failed", { timeout: 120000 });
  const seconds = (Date.now() - start) / 1000;
  const failed = await tab.evaluate(() => document.body.classList.contains("failed") && document.getElementById("status").textContent);
  if (failed) throw new Error(failed);
  const took = {};
  for (const mode of modes) {
    const picture = await tab.evaluate(async ({ view, mode }) => {
      const viewer = await window.motes;
      const index = viewer.manifest.photos.findIndex((photo) => photo.name === view);
      const start = performance.now();
      const { width, height, bytes } = await viewer.pixels(index, mode);
      const ms = performance.now() - start;
      const sheet = Object.assign(document.createElement("canvas"), { width, height });
      sheet.getContext("2d").putImageData(new ImageData(bytes, width, height), 0, 0);
      return { url: sheet.toDataURL("image/png"), ms };
    }, { view, mode });
    savePng(join(folder, `${mode}.png`), picture.url);
    took[mode] = picture.ms;
  }
  await tab.screenshot({ path: join(folder, "screen.png") });
  // The page itself and workers made from its own text are all that may be asked for.
  const outside = requests.filter((url) => !/^(file|blob|data):/.test(url));
  return { ready_s: seconds, took_ms: took, outside, panel: await tab.textContent("#panel") };
});
console.log(JSON.stringify(report));
