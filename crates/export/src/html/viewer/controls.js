// Mouse, touch, keyboard and the panel.

class Controls {
  constructor(viewer) {
    this.viewer = viewer;
    this.pointers = new Map();
    this.pressed = new Set();
    this.panel();
    this.pointer($("canvas"));
    this.divider($("divider"));
    this.keyboard();
    window.addEventListener("resize", () => (viewer.dirty = true));
  }

  options(select, values, labels) {
    select.replaceChildren(...values.map((value, i) => new Option(labels?.[i] ?? LABELS[value] ?? value, value)));
  }

  panel() {
    const { viewer } = this;
    const { manifest } = viewer;
    this.options($("mode"), viewer.modes);
    this.options($("compare"), viewer.comparisons);
    this.options($("how"), ["slider", "flicker", "difference"]);
    this.options($("light"), manifest.lights.map((_, i) => i), manifest.lights.map((light) => light.name));
    this.options($("view"), [-1, ...manifest.photos.map((_, i) => i)], ["go to a photo", ...manifest.photos.map((photo) => photo.name)]);
    for (const key of ["mode", "compare", "how"]) $(key).onchange = () => this.set(key, $(key).value);
    for (const key of ["light", "angle", "exposure"]) $(key).oninput = () => viewer.changed({ [key]: Number($(key).value) });
    $("view").onchange = () => viewer.look(Number($("view").value));
    $("previous").onclick = () => this.step(-1);
    $("next").onclick = () => this.step(1);
    $("reset").onclick = () => viewer.resetCamera();
    $("fly").onclick = () => viewer.changed({ fly: !viewer.state.fly });
    $("mark").onclick = () => viewer.pointer.mark();
    $("path").onclick = () => viewer.pointer.copyPath();
    $("help-button").onclick = () => $("help").showModal();
    this.refresh();
  }

  set(key, value) {
    const { viewer } = this;
    viewer.changed({ [key]: value });
    // A photo can only lie over the view that it was taken from.
    if (key === "compare" && value === "photo" && !viewer.atPhoto) viewer.look(Math.max(0, viewer.state.view));
  }

  step(by) {
    const n = this.viewer.manifest.photos.length;
    if (n) this.viewer.look((((this.viewer.state.view < 0 && by < 0 ? 0 : this.viewer.state.view) + by) % n + n) % n);
  }

  // The controls as the state says.
  refresh() {
    const { state, manifest, modes, comparisons } = this.viewer;
    for (const key of ["mode", "compare", "how", "light", "angle", "exposure", "view"]) $(key).value = String(state[key]);
    $("fly").setAttribute("aria-pressed", String(state.fly));
    const shows = (id, yes) => ($(id).style.display = yes ? "" : "none");
    shows("light-rows", modes.includes("relit") && [state.mode, state.compare].includes("relit"));
    shows("light-row", manifest.lights.length > 1);
    shows("photo-row", manifest.photos.length);
    $("mode").parentElement.style.display = modes.length > 1 ? "" : "none";
    $("compare").parentElement.style.display = comparisons.length > 1 ? "" : "none";
    shows("how-row", state.compare !== "none");
    [...$("how").options].find((o) => o.value === "difference").disabled = state.compare !== "photo";
    if (state.compare !== "photo" && state.how === "difference") state.how = $("how").value = "slider";
  }

  pointer(canvas) {
    const { viewer, pointers } = this;
    canvas.onpointerdown = (event) => {
      if (viewer.tool?.press(event)) return;
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      this.pressedAt = pointers.size === 1 && event.button === 0 && (viewer.tool || !event.shiftKey) ? [event.clientX, event.clientY] : null;
    };
    canvas.onpointerup = canvas.onpointercancel = (event) => {
      pointers.delete(event.pointerId);
      // A press that did not drag is a click.
      if (event.type === "pointerup" && this.pressedAt) (viewer.tool ?? viewer.pointer).click(...this.pressedAt, event.shiftKey);
      this.pressedAt = null;
    };
    canvas.onpointerleave = () => viewer.pointer.hover(null);
    canvas.oncontextmenu = (event) => event.preventDefault();
    canvas.ondblclick = () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen?.());
    canvas.onpointermove = (event) => {
      const old = pointers.get(event.pointerId);
      const now = [event.clientX, event.clientY];
      if (!old) return viewer.pointer.hover(now);
      if (this.pressedAt) {
        if (Math.hypot(now[0] - this.pressedAt[0], now[1] - this.pressedAt[1]) < 4) return;
        this.pressedAt = null;
      }
      const step = [now[0] - old[0], now[1] - old[1]];
      if (pointers.size === 2) this.pinch(event.pointerId, old, now);
      else if (event.shiftKey || event.buttons & 6) this.pan(step);
      else viewer.camera.turn(-step[0] * 0.006, -step[1] * 0.006, viewer.state.fly);
      pointers.set(event.pointerId, now);
      viewer.moved();
    };
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const pixels = event.deltaY * (event.deltaMode ? 33 : 1);
      if (viewer.state.fly) viewer.camera.move(0, 0, -pixels * 0.001 * viewer.camera.distance);
      else viewer.camera.dolly(Math.exp(Math.max(-1, Math.min(1, pixels * 0.001))));
      viewer.moved();
    }, { passive: false });
  }

  // Moves so that what is at the distance of the target follows the pointer.
  pan(step) {
    const { camera } = this.viewer;
    const pinhole = camera.pinhole(window.innerWidth, window.innerHeight);
    camera.move((-step[0] * camera.distance) / pinhole.fx, (-step[1] * camera.distance) / pinhole.fy, 0);
  }

  pinch(id, old, now) {
    const other = [...this.pointers].find(([key]) => key !== id)[1];
    const apart = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
    this.viewer.camera.dolly(apart(old) / apart(now));
    this.pan([(now[0] - old[0]) / 2, (now[1] - old[1]) / 2]);
  }

  divider(bar) {
    const { viewer } = this;
    const clamped = (v) => Math.max(0, Math.min(1, v));
    bar.onpointerdown = (event) => bar.setPointerCapture(event.pointerId);
    bar.onpointermove = (event) => {
      if (bar.hasPointerCapture(event.pointerId)) viewer.changed({ split: clamped(event.clientX / window.innerWidth) });
    };
    bar.onkeydown = (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
      if (!step) return;
      event.stopPropagation();
      viewer.changed({ split: clamped(viewer.state.split + step) });
    };
  }

  keyboard() {
    const { viewer } = this;
    const cycle = (key, values) => this.set(key, values[(values.indexOf(viewer.state[key]) + 1) % values.length]);
    const once = {
      m: () => viewer.pointer.mark(), k: () => viewer.pointer.copyPath(),
      n: () => this.step(1), p: () => this.step(-1), r: () => viewer.resetCamera(), h: () => $("help").showModal(),
      f: () => viewer.changed({ fly: !viewer.state.fly }),
      c: () => cycle("compare", viewer.comparisons), v: () => cycle("how", ["slider", "flicker", "difference"]),
    };
    window.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || $("help").open) return;
      if (event.target instanceof HTMLSelectElement || event.target instanceof HTMLInputElement) return;
      if (viewer.tool?.key(event)) return event.preventDefault();
      const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
      const mode = viewer.modes[Number(key) - 1];
      if (once[key]) once[key]();
      else if (mode) viewer.changed({ mode });
      else if ("wasdqe[]".includes(key) || key.startsWith("Arrow") || key === "Shift") this.pressed.add(key);
      else return;
      event.preventDefault();
    });
    window.addEventListener("keyup", (event) => this.pressed.delete(event.key.length === 1 ? event.key.toLowerCase() : event.key));
    window.addEventListener("blur", () => this.pressed.clear());
  }

  // Keys that are held act by time, not by repetition.
  keys(now) {
    const seconds = Math.min(0.1, (now - (this.lastTick ?? now)) / 1000);
    this.lastTick = now;
    const { viewer, pressed } = this;
    const axis = (plus, minus) => Number(pressed.has(plus)) - Number(pressed.has(minus));
    const speed = viewer.home * 0.5 * seconds * (pressed.has("Shift") ? 4 : 1);
    const step = [axis("d", "a"), axis("q", "e"), axis("w", "s")];
    const turn = [axis("ArrowLeft", "ArrowRight"), axis("ArrowUp", "ArrowDown")];
    if (step.some(Boolean)) viewer.camera.move(...step.map((v) => v * speed));
    if (turn.some(Boolean)) viewer.camera.turn(turn[0] * 1.2 * seconds, turn[1] * 1.2 * seconds, viewer.state.fly);
    if (step.some(Boolean) || turn.some(Boolean)) viewer.moved();
    const light = axis("]", "[");
    if (light) viewer.changed({ angle: (viewer.state.angle + light * 60 * seconds + 360) % 360 });
  }
}
