// The light: a sun that is dragged across the sky, lights by name, the captured light turned.

// Radius of the sky on its picture.
const SKY = 52;
// A drag has ended when nothing follows for so long, milliseconds.
const LET_GO = 700;

class Sky {
  constructor(live) {
    this.live = live;
    this.sun = { azimuth: 0, elevation: 45 };
    this.drag = 0; // number of the drag that goes on
    this.landed = null; // the last drag that is in the plan
    const shown = Boolean(live.viewer.manifest.session.light);
    $("light-part").hidden = !shown;
    if (!shown) return;
    this.maps = live.viewer.manifest.session.maps;
    $("preset").append(...this.maps.map(({ name }, i) => new Option(name, `map:${i}`)));
    this.dome($("sky"));
    for (const key of ["azimuth", "elevation"]) {
      $(key).oninput = () => {
        this.sun[key] = Number($(key).value);
        this.wish("sun");
      };
    }
    $("preset").onchange = () => this.wish("preset");
    $("heading").oninput = $("brightness").oninput = () => this.wish(this.kind ?? "captured");
    // The end of a drag: what follows is another act.
    for (const id of ["azimuth", "elevation", "heading", "brightness"]) $(id).onchange = () => this.let();
  }

  // Turns the light by so many degrees.
  turn(step) {
    if ($("light-part").hidden) return;
    $("heading").value = (Number($("heading").value) + step + 360) % 360;
    this.wish(this.kind ?? "captured");
  }

  dome(svg) {
    const to = (event) => {
      const box = svg.getBoundingClientRect();
      const [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height].map((v) => (2 * v - 1) * (60 / SKY));
      // Seen from above, x of the world to the right; the middle is the zenith.
      this.sun.azimuth = Math.round(((Math.atan2(-y, x) * 180) / Math.PI + 360) % 360);
      this.sun.elevation = Math.round(90 * (1 - Math.min(1, Math.hypot(x, y))));
      this.wish("sun");
    };
    svg.onpointerdown = (event) => {
      svg.setPointerCapture(event.pointerId);
      to(event);
      svg.onpointermove = to;
    };
    svg.onpointerup = svg.onpointercancel = () => {
      svg.onpointermove = null;
      this.let();
    };
  }

  // What follows is another act; not at once, because keys that are held let go after every step.
  let() {
    this.timer = setTimeout(() => this.drag++, LET_GO);
  }

  body() {
    const preset = this.kind === "preset" ? $("preset").value : "";
    const map = preset.startsWith("map:") ? Number(preset.slice(4)) : null;
    const named = map === null && preset ? preset : null;
    const sun = this.kind === "sun" ? `azimuth=${this.sun.azimuth},elevation=${this.sun.elevation}` : named;
    return { sun, map, rotate_deg: Number($("heading").value), exposure: Number((2 ** Number($("brightness").value)).toPrecision(5)) };
  }

  // A light that somebody wishes; while one is computed only the last wish is kept.
  async wish(kind) {
    clearTimeout(this.timer);
    this.kind = kind === "preset" && !$("preset").value ? "captured" : kind;
    if (kind === "preset") this.drag++;
    this.refresh();
    this.next = { drag: this.drag, body: this.body() };
    if (kind === "preset") this.drag++;
    this.sending ??= this.send().finally(() => (this.sending = null));
    return this.sending;
  }

  async send() {
    while (this.next) {
      const { drag, body } = this.next;
      this.next = null;
      // Each light of a drag takes the place of the one before.
      if (await this.live.send("light", { ...body, replace: this.landed === drag })) this.landed = drag;
      await this.live.isDrawn();
    }
  }

  // The light of the plan, whoever wished it; not while we wish another.
  follow(steps) {
    if (this.sending || $("light-part").hidden) return;
    const last = steps.findLast(({ op }) => op === "set_environment");
    const angles = /^azimuth=([\d.]+),elevation=([\d.]+)$/.exec(last?.sun ?? "");
    if (angles) [this.sun.azimuth, this.sun.elevation] = [Number(angles[1]), Number(angles[2])];
    const map = this.maps.findIndex(({ file }) => file === last?.file);
    const preset = map < 0 ? last?.sun ?? "" : `map:${map}`;
    this.kind = angles ? "sun" : preset ? "preset" : "captured";
    if (!angles) $("preset").value = preset;
    $("heading").value = last?.rotate_deg ?? 0;
    $("brightness").value = Math.log2(last?.exposure ?? 1);
    this.refresh();
  }

  refresh() {
    const { azimuth, elevation } = this.sun;
    $("azimuth").value = azimuth;
    $("elevation").value = elevation;
    $("azimuth-value").textContent = `${azimuth}°`;
    $("elevation-value").textContent = `${elevation}°`;
    if (this.kind === "sun") $("preset").value = "sun";
    const [angle, away] = [(azimuth * Math.PI) / 180, SKY * (1 - elevation / 90)];
    $("sun").setAttribute("cx", 60 + away * Math.cos(angle));
    $("sun").setAttribute("cy", 60 - away * Math.sin(angle));
    $("sun").classList.toggle("off", this.kind !== "sun");
  }
}
