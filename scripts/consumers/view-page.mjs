// node view-page.mjs FOLDER URL VIEW X Y
// Opens the page of `motes view`, goes to VIEW, clicks its pixel X, Y, refines, names, moves by the keyboard of a handle, sets a
// material, drags the sun, undoes and redoes, all with mouse and keys as people have them. Saves pictures in FOLDER. Prints a line
// of JSON.

import { join } from "node:path";
import { withTab } from "./browser.mjs";

const [folder, url, view, x, y] = process.argv.slice(2);
const shot = (tab, name) => tab.screenshot({ path: join(folder, `${name}.png`) });
const live = (tab, read) => tab.evaluate(`window.motes.then((viewer) => (${read})(viewer, viewer.live))`);
// Waits until `condition([live, wanted])` holds; one that gave a promise would count as true at once.
const until = async (tab, condition, wanted, options) => {
  const page = await tab.evaluateHandle("window.motes.then(({ live }) => live)");
  await tab.waitForFunction(condition, [page, wanted], { timeout: 120000, ...options });
};
const acted = (tab, count) => until(tab, ([{ state }, count]) => state.steps.length === count, count);
// Everything that is known is in the picture.
const atRest = (tab) => until(tab, ([{ viewer, following }]) => !(viewer.dirty || viewer.unsorted || viewer.sorting || following));
const settled = async (tab) => {
  await live(tab, "(viewer, live) => live.isSettled()");
  await atRest(tab);
};
const opened = async (tab) => {
  await tab.goto(url);
  await tab.waitForSelector("body.ready, body.failed", { timeout: 120000 });
};

const report = await withTab({ width: 1280, height: 800 }, async (tab) => {
  const outside = [];
  tab.on("request", (request) => request.url().startsWith(url) || request.url().startsWith("blob:") || request.url().startsWith("data:") || outside.push(request.url()));
  await opened(tab);
  await until(tab, ([{ state }]) => state.views === "ready");
  await live(tab, `(viewer) => viewer.look(viewer.manifest.photos.findIndex(({ name }) => name === ${JSON.stringify(view)}))`);
  await atRest(tab);
  // Where a pixel of the view is in the window.
  const place = await live(tab, `(viewer) => {
    const { size } = viewer.manifest.photos[viewer.state.view];
    const { frame } = viewer.camera.pinhole(innerWidth, innerHeight);
    return [frame.x + ((${x} + 0.5) / size[0]) * frame.width, frame.y + ((${y} + 0.5) / size[1]) * frame.height];
  }`);
  const start = Date.now();
  await tab.mouse.click(...place);
  await until(tab, ([{ viewer }]) => viewer.splats[0].marked, null, { polling: 10 });
  const milliseconds = Date.now() - start;
  // Without the drawing, which is slow where there is no graphics processor.
  const answer = await tab.evaluate(() => performance.getEntriesByName(new URL("prompt", location.href).href).pop().duration);
  const clicked = await live(tab, "(viewer, live) => live.state.selection");
  await atRest(tab);
  await shot(tab, "selected");
  // What Shift says does not belong.
  await tab.keyboard.down("Shift");
  await tab.mouse.click(place[0], 760);
  await tab.keyboard.up("Shift");
  await until(tab, ([{ state }]) => state.selection?.gestures === 2);
  // The answer to the name comes late, when somebody has gone on to a handle.
  let answerName;
  const late = new Promise((resolve) => (answerName = resolve));
  await tab.route("**/keep", async (route) => {
    const response = await route.fetch();
    await late;
    await route.fulfill({ response });
  });
  await tab.fill("#name", "thing");
  await tab.keyboard.press("Enter");
  await until(tab, ([{ state }]) => state.selections.includes("thing"));
  await tab.selectOption("#material", "brass");
  await tab.click("#set-material");
  await acted(tab, 2);
  // A handle by keys: two steps along the first axis. What is not shown takes no focus.
  await tab.waitForSelector("#handles.shown");
  await tab.focus("#handle-x");
  await tab.keyboard.press("ArrowRight");
  answerName();
  await tab.waitForFunction(() => document.getElementById("name").value === "");
  await tab.keyboard.press("ArrowRight");
  await atRest(tab);
  await shot(tab, "moving");
  await tab.keyboard.press("Enter");
  await acted(tab, 3);
  // The sun is dragged across its disc: one act.
  let acts = 3;
  if (await tab.isVisible("#sky")) {
    const sky = await tab.locator("#sky").boundingBox();
    const on = (u, v) => [sky.x + u * sky.width, sky.y + v * sky.height];
    await tab.mouse.move(...on(0.7, 0.3));
    await tab.mouse.down();
    for (const u of [0.65, 0.6, 0.5, 0.4, 0.3]) {
      await tab.mouse.move(...on(u, 0.3));
      await tab.waitForTimeout(100);
    }
    await tab.mouse.up();
    await live(tab, "(viewer, live) => live.sky.sending");
    acts = 4;
  }
  await settled(tab);
  await shot(tab, "lit");
  const steps = await live(tab, "(viewer, live) => live.state.steps");
  // Back and forth by keys of the picture.
  await tab.click("#edit summary");
  await tab.click("#edit summary");
  for (let k = 0; k < 2; k++) await tab.keyboard.press("Control+z");
  await acted(tab, acts - 2);
  for (let k = 0; k < 2; k++) await tab.keyboard.press("Control+Shift+z");
  await acted(tab, acts);
  await settled(tab);
  await tab.click("#compare-before");
  await atRest(tab);
  await shot(tab, "before-after");
  await tab.click("#compare-before");
  await tab.click("#copy-command");
  const copied = await live(tab, "(viewer) => viewer.pointer.copied");
  const [download] = await Promise.all([tab.waitForEvent("download"), tab.click("#save-plan")]);
  await download.saveAs(join(folder, "edit-plan.json"));
  await tab.click("#help-button");
  await tab.waitForSelector("#help[open]");
  await shot(tab, "help");
  return { milliseconds, answer, clicked, steps, copied, outside };
});
// The page of somebody else, who sees the same; small.
report.phone = await withTab({ width: 390, height: 844 }, async (tab) => {
  await opened(tab);
  await atRest(tab);
  await shot(tab, "phone");
  await tab.click("#edit summary");
  await tab.waitForSelector("#edit[open]");
  await shot(tab, "phone-edit");
  const wide = await tab.evaluate("document.documentElement.scrollWidth");
  return { wide, steps: await live(tab, "(viewer, live) => live.state.steps.length") };
});
console.log(JSON.stringify(report));
