// Pointer and keyboard on the picture: clicks, boxes and strokes that select.

class Tools {
  constructor(live) {
    this.live = live;
    this.viewer = live.viewer;
    this.mode = "click";
    this.removes = false;
    window.addEventListener("keydown", (event) => this.shortcut(event));
  }

  // Boxes and strokes are drawn over a photo's view: the nearest one is gone to.
  use(mode) {
    this.mode = this.mode === mode ? "click" : mode;
    if (this.mode !== "click" && !this.viewer.atPhoto) this.viewer.look(this.nearestPhoto());
    if (this.mode !== "click" && !this.viewer.atPhoto) this.mode = "click";
    document.body.classList.toggle("drawing", this.mode !== "click");
    this.live.panel.refresh();
  }

  nearestPhoto() {
    const { camera, manifest } = this.viewer;
    const apart = ({ eye, rotation }) => length(add(eye, camera.eye, -1)) / this.viewer.home + (1 - dot(rotation[2], camera.forward));
    return manifest.photos.reduce((best, photo, i, all) => (best < 0 || apart(photo) < apart(all[best]) ? i : best), -1);
  }

  // A press on the picture; true when a box or a stroke begins with it.
  press(event) {
    if (this.mode === "click" || event.button !== 0 || !this.viewer.atPhoto) return false;
    const canvas = $("canvas");
    const remove = event.shiftKey || this.removes;
    const points = [[event.clientX, event.clientY]];
    canvas.setPointerCapture(event.pointerId);
    const move = (event) => {
      const now = [event.clientX, event.clientY];
      if (this.mode === "box") points[1] = now;
      else if (Math.hypot(now[0] - points.at(-1)[0], now[1] - points.at(-1)[1]) > 5) points.push(now);
      this.outline(points);
    };
    const end = (event) => {
      canvas.removeEventListener("pointermove", move);
      canvas.removeEventListener("pointerup", end);
      canvas.removeEventListener("pointercancel", end);
      this.outline([]);
      if (event.type === "pointerup") this.drawn(points, remove);
    };
    canvas.addEventListener("pointermove", move);
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    return true;
  }

  outline(points) {
    const corners = this.mode === "box" && points.length === 2 ? [points[0], [points[1][0], points[0][1]], points[1], [points[0][0], points[1][1]], points[0]] : points;
    $("outline").setAttribute("points", corners.map((p) => p.join(",")).join(" "));
  }

  drawn(points, remove) {
    const { viewer, live } = this;
    const view = viewer.manifest.photos[viewer.state.view].name;
    const pixels = points.map((p) => this.pixelAt(p));
    if (this.mode === "box") {
      if (pixels.length === 2) live.send("prompt", { kind: "box", view, pixels: pixels.flat() });
    } else live.send("prompt", { kind: "stroke", view, points: pixels, positive: !remove });
  }

  // The pixel of the photo that is gone to, at a place of the window.
  pixelAt([x, y]) {
    const { viewer } = this;
    const { size } = viewer.manifest.photos[viewer.state.view];
    const { frame } = viewer.camera.pinhole(window.innerWidth, window.innerHeight);
    const at = [((x - frame.x) / frame.width) * size[0], ((y - frame.y) / frame.height) * size[1]];
    return at.map((v, k) => Math.round(10 * Math.max(0, Math.min(size[k] - 1, v))) / 10);
  }

  // A click selects, or with Shift takes away.
  async click(x, y, shift) {
    const { viewer, live } = this;
    const found = viewer.pointer.read(x, y);
    if (!found) return live.say("nothing is there");
    const { point, photo, pixel } = found;
    const body = { kind: "click", point, eye: viewer.camera.eye, positive: !(shift || this.removes) };
    if (viewer.atPhoto && photo) Object.assign(body, { view: photo.name, pixel });
    await live.send("prompt", body);
  }

  // A key while nothing that takes text has the focus; true when it meant something.
  key(event) {
    const { live, viewer } = this;
    const onPicture = document.activeElement === $("canvas") || document.activeElement === document.body;
    const middle = [Math.floor(window.innerWidth / 2), Math.floor(window.innerHeight / 2)];
    const keys = {
      Enter: () => onPicture && this.click(...middle, event.shiftKey),
      Escape: () => (this.mode !== "click" ? this.use(this.mode) : live.send("clear")),
      Delete: () => live.panel.remove(), Backspace: () => live.panel.remove(),
      u: () => live.send("undo"), y: () => live.send("redo"),
      o: () => this.use("box"), b: () => this.use("brush"), x: () => live.panel.toggleRemove(),
      t: () => live.panel.beforeAfter(), "[": () => live.sky.turn(-5), "]": () => live.sky.turn(5),
    };
    const act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act || (event.key === "Enter" && !onPicture)) return false;
    act();
    viewer.dirty = true;
    return true;
  }

  // The usual keys of undo and redo.
  shortcut(event) {
    if (!(event.ctrlKey || event.metaKey) || event.target instanceof HTMLInputElement) return;
    const key = event.key.toLowerCase();
    if (key !== "z" && key !== "y") return;
    event.preventDefault();
    this.live.send(key === "y" || event.shiftKey ? "redo" : "undo");
  }
}
