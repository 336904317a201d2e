// node page-pointer.mjs PAGE.html FOLDER VIEW X Y
// Opens a page of `export --html` from file://, goes to VIEW, points and clicks at the pixel X, Y of it, then turns the camera
// and clicks the middle. Saves FOLDER/photo.png, FOLDER/free.png and FOLDER/path.json. Prints a line of JSON.

import { writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { withTab } from "./browser.mjs";

const [page, folder, view, x, y] = process.argv.slice(2);

const report = await withTab({ width: 1000, height: 700 }, async (tab) => {
  await tab.goto(`${pathToFileURL(resolve(page))}#view=${encodeURIComponent(view)}`);
  await tab.waitForSelector("body.ready, body.failed", { timeout: 120000 });
  // Where a pixel of the view is in the window.
  const place = await tab.evaluate(async ({ view, x, y }) => {
    const viewer = await window.motes;
    const { size } = viewer.manifest.photos.find((photo) => photo.name === view);
    const { frame } = viewer.camera.pinhole(innerWidth, innerHeight);
    return [frame.x + ((x + 0.5) / size[0]) * frame.width, frame.y + ((y + 0.5) / size[1]) * frame.height];
  }, { view, x: Number(x), y: Number(y) });
  const said = async (id) => (await tab.textContent(id)).trim();
  const clickAt = async ([left, top]) => {
    await tab.evaluate(() => (document.getElementById("remark").textContent = ""));
    await tab.mouse.click(left, top);
    await tab.waitForFunction(() => document.getElementById("remark").textContent);
    return { copied: await tab.evaluate(async () => (await window.motes).pointer.copied), remark: await said("#remark") };
  };
  await tab.mouse.move(...place);
  await tab.waitForFunction(() => document.getElementById("pointer").textContent);
  const hover = await said("#pointer");
  const photo = await clickAt(place);
  await tab.screenshot({ path: join(folder, "photo.png") });
  // A drag is no click.
  await tab.evaluate(() => (document.getElementById("remark").textContent = ""));
  await tab.mouse.move(500, 350);
  await tab.mouse.down();
  await tab.mouse.move(540, 360, { steps: 4 });
  await tab.mouse.up();
  const dragged = await said("#remark");
  await tab.waitForTimeout(1500);
  const free = await clickAt([500, 400]);
  free.point = await tab.evaluate(async () => {
    const viewer = await window.motes;
    await viewer.sort();
    return viewer.pointer.read(500, 400)?.point;
  });
  await tab.screenshot({ path: join(folder, "free.png") });
  await tab.keyboard.press("k");
  await tab.waitForFunction(() => document.getElementById("remark").textContent.includes("camera-path"));
  writeFileSync(join(folder, "path.json"), await tab.evaluate(async () => (await window.motes).pointer.copied));
  return { hover, photo, dragged, free };
});
console.log(JSON.stringify(report));
