// Starts the page. `#view=NAME&mode=...&compare=...&how=...&split=...&angle=...&exposure=...&ui=0` sets
// what it shows first, so that a link shows what its author saw.

// What the page itself holds.
class PageSource {
  block(splat, index) {
    const element = $(`splat-${splat}-${index}`);
    const bytes = bytesOfBase64(element.textContent);
    element.remove(); // the text is no longer needed
    return bytes;
  }

  photo(view) {
    return `data:image/jpeg;base64,${$(`photo-${view}`).textContent}`;
  }
}

async function start() {
  const manifest = JSON.parse($("manifest").textContent);
  const viewer = new Viewer(manifest, new PageSource());
  const wish = new URLSearchParams(location.hash.slice(1));
  document.body.classList.toggle("bare", wish.get("ui") === "0");
  await viewer.load();
  viewer.controls = new Controls(viewer);
  const { modes, comparisons } = viewer;
  if (modes.includes(wish.get("mode"))) viewer.changed({ mode: wish.get("mode") });
  for (const key of ["split", "angle", "exposure", "light"]) {
    const value = Number(wish.get(key));
    if (wish.has(key) && Number.isFinite(value)) viewer.changed({ [key]: value });
  }
  if (["slider", "flicker", "difference"].includes(wish.get("how"))) viewer.changed({ how: wish.get("how") });
  const stem = (name) => name.replace(/\.[^./]+$/, "");
  const called = (same) => manifest.photos.findIndex((photo) => same(photo.name));
  const wanted = wish.get("view");
  const exact = called((name) => name === wanted);
  const view = exact >= 0 ? exact : called((name) => stem(name) === wanted);
  if (view >= 0) viewer.look(view);
  if (comparisons.includes(wish.get("compare"))) viewer.controls.set("compare", wish.get("compare"));
  await viewer.sort();
  viewer.present();
  return viewer;
}

// For those who measure: `await motes`, then `.pixels(view, mode)`, `.psnr(view)`.
window.motes = start();
window.motes.then(
  () => document.body.classList.add("ready"),
  (error) => {
    document.body.classList.add("failed");
    $("status").textContent = `This page cannot be shown: ${error.message}`;
    console.error(error);
  },
);
