// Handles on what is selected: three arrows that move it, one that turns it about up, one that scales it.

// Length of an arrow, CSS pixels.
const ARROW = 64;
// Radians and powers of e per pixel of a drag.
const TURN_STEP = 0.01;
const SCALE_STEP = 0.006;

class Handles {
  constructor(live) {
    this.live = live;
    const up = unit(live.viewer.manifest.up);
    const side = unit(cross(Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], up));
    this.axes = [cross(up, side), side, up].map((axis) => axis.map((v) => v + 0)); // world, right-handed, up last
    this.reset();
    for (const kind of ["x", "y", "z", "turn", "scale"]) this.handle($(`handle-${kind}`), kind);
  }

  reset() {
    this.wish = { x: 0, y: 0, z: 0, turn: 0, scale: 0 };
  }

  get isIdle() {
    return Object.values(this.wish).every((v) => v === 0);
  }

  get translation() {
    const { x, y, z } = this.wish;
    return [x, y, z].reduce((sum, v, k) => add(sum, this.axes[k], v), [0, 0, 0]);
  }

  // Where the arrows are now, on the window.
  place() {
    const { viewer, state } = this.live;
    const centroid = state.selection?.centroid;
    const shown = Boolean(centroid) && this.live.tools.mode === "click" && viewer.state.compare === "none";
    $("handles").classList.toggle("shown", shown);
    if (!shown) return;
    const at = add(centroid, this.translation);
    const pinhole = viewer.camera.pinhole(window.innerWidth, window.innerHeight);
    const project = (p) => {
      const arm = add(p, viewer.camera.eye, -1);
      const [x, y, z] = viewer.camera.axes.map((axis) => dot(axis, arm));
      return z > 1e-6 ? [pinhole.cx + (pinhole.fx * x) / z, pinhole.cy + (pinhole.fy * y) / z, z] : null;
    };
    const middle = project(at);
    $("handles").classList.toggle("shown", Boolean(middle));
    if (!middle) return;
    this.perPixel = middle[2] / pinhole.fx;
    this.tips = {};
    for (const [k, kind] of ["x", "y", "z"].entries()) {
      const tip = project(add(at, this.axes[k], ARROW * this.perPixel)) ?? middle;
      this.tips[kind] = [tip[0] - middle[0], tip[1] - middle[1]];
      this.draw(kind, middle, tip);
    }
    this.draw("turn", middle, [middle[0] - 46, middle[1] + 46]);
    this.draw("scale", middle, [middle[0] + 46, middle[1] + 46]);
  }

  draw(kind, from, to) {
    const line = $(`line-${kind}`);
    for (const [key, value] of Object.entries({ x1: from[0], y1: from[1], x2: to[0], y2: to[1] })) line.setAttribute(key, value);
    $(`handle-${kind}`).setAttribute("transform", `translate(${to[0]} ${to[1]})`);
  }

  handle(element, kind) {
    element.onpointerdown = (event) => {
      event.stopPropagation();
      element.setPointerCapture(event.pointerId);
      const start = [event.clientX, event.clientY];
      const tip = this.tips?.[kind];
      const before = this.wish[kind];
      element.onpointermove = (event) => {
        const step = [event.clientX - start[0], event.clientY - start[1]];
        this.wish[kind] = before + this.drag(kind, step, tip);
        this.preview();
      };
      element.onpointerup = element.onpointercancel = (event) => {
        element.onpointermove = element.onpointerup = element.onpointercancel = null;
        if (event.type === "pointerup") this.apply();
        else this.cancel();
      };
    };
    element.onkeydown = (event) => {
      const sign = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (sign) {
        const size = this.live.state.selection;
        const step = { turn: Math.PI / 36, scale: 0.05 }[kind] ?? 0.05 * length(add(size.max, size.min, -1));
        this.wish[kind] += sign * step;
        this.preview();
      } else if (event.key === "Enter") this.apply();
      else if (event.key === "Escape") this.cancel();
      else return;
      event.stopPropagation();
      event.preventDefault();
    };
  }

  // What a drag of so many pixels means.
  drag(kind, step, tip) {
    if (kind === "turn") return step[0] * TURN_STEP;
    if (kind === "scale") return (step[0] - step[1]) * SCALE_STEP;
    const square = tip[0] ** 2 + tip[1] ** 2;
    // An arrow that points at us hardly moves on the picture.
    if (square < 25) return 0;
    return ((step[0] * tip[0] + step[1] * tip[1]) / square) * ARROW * this.perPixel;
  }

  // What a handle says to those who do not see it.
  tell() {
    const values = { turn: `${Math.round((this.wish.turn * 180) / Math.PI)} degrees`, scale: `times ${Math.exp(this.wish.scale).toPrecision(3)}` };
    for (const kind of Object.keys(this.wish)) $(`handle-${kind}`).setAttribute("aria-valuetext", values[kind] ?? `${this.wish[kind].toPrecision(3)} units`);
  }

  // Shows where it will be; the server moves it when it is let go.
  preview() {
    const { viewer, state } = this.live;
    const centroid = state.selection?.centroid;
    if (!centroid) return;
    const scale = Math.exp(this.wish.scale);
    const columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((e) => turned(e, this.axes[2], this.wish.turn));
    const rotated = [0, 1, 2].map((k) => columns.reduce((sum, column, j) => sum + column[k] * scale * centroid[j], 0));
    const translation = add(add(centroid, rotated, -1), this.translation);
    viewer.splats[0].motion = { scale, rotation: columns.flat(), translation };
    this.tell();
    viewer.dirty = true;
  }

  cancel() {
    this.reset();
    this.live.viewer.splats[0].motion = null;
    this.live.viewer.dirty = true;
  }

  // The wish as an operation of a plan.
  async apply() {
    if (this.isIdle) return;
    const rounded = (v, digits) => Number(v.toPrecision(digits));
    const op = { op: "transform", fill: $("fill").value };
    const { x, y, z, turn, scale } = this.wish;
    if (x || y || z) op.translate = this.translation.map((v) => rounded(v, 6));
    if (turn) op.rotate_axis = { axis: this.axes[2], deg: rounded((turn * 180) / Math.PI, 5) };
    if (scale) op.scale = rounded(Math.exp(scale), 5);
    this.reset();
    if (!(await this.live.send("act", { op }))) this.cancel();
  }
}
