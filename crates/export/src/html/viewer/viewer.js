// The page: reads Gaussians and photos from its source, keeps the state that the controls change, draws when something changed.

const $ = (id) => document.getElementById(id);
const LABELS = {
  appearance: "as captured", relit: "relit (shadows stay)", base_color: "base color", normal: "normal", roughness: "roughness",
  metallic: "metallic", visibility: "visibility", object_id: "objects", splat: "second splat", photo: "photo", none: "nothing",
};

class Viewer {
  // `source.block(splat, block)` has the compressed bytes of a block, `source.photo(view)` the address of a picture.
  constructor(manifest, source) {
    this.manifest = manifest;
    this.source = source;
    this.renderer = new Renderer($("canvas"), SHADERS);
    this.camera = new Camera(manifest.up);
    this.splats = [];
    this.background = manifest.background;
    // Everything that a control changes.
    this.state = { mode: "appearance", compare: "none", how: "slider", split: 0.5, light: 0, angle: 0, exposure: 0, view: -1, fly: false };
    this.scale = 1; // of the resolution, lower while a slow machine moves
    this.dirty = true;
    this.drawMs = 0;
    this.images = manifest.photos.map(() => null);
    this.pointer = new Pointer(this);
    this.resetCamera();
  }

  get modes() {
    const first = this.manifest.splats[0];
    const modes = ["appearance"];
    if (first.materials) {
      modes.push("base_color", "normal", "roughness", "metallic", "visibility");
      if (first.objects) modes.push("object_id");
      if (this.manifest.lights.length) modes.push("relit");
    }
    return modes;
  }

  get comparisons() {
    const more = this.modes.filter((mode) => mode !== "appearance");
    if (this.manifest.splats.length > 1) more.unshift("splat");
    if (this.manifest.photos.length) more.unshift("photo");
    return ["none", ...more];
  }

  async load() {
    let loaded = 0;
    const total = this.manifest.splats.reduce((sum, s) => sum + s.count, 0);
    for (const [s, manifest] of this.manifest.splats.entries()) {
      const progress = (count) => {
        loaded += count;
        this.say(`reading ${Math.round((100 * loaded) / Math.max(total, 1))} %`);
      };
      this.splats.push(await this.splatOf(manifest, (b) => this.source.block(s, b), progress));
    }
    await this.sort();
    this.describe();
    this.dirty = true;
    const frame = (now) => {
      this.tick(now);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }

  // The Gaussians of a manifest; `block(b)` has the bytes of one of its blocks.
  async splatOf(manifest, block, progress) {
    const splat = this.renderer.splatOf(manifest);
    const means = new Float32Array(3 * manifest.count);
    for (let b = 0; b * BLOCK < manifest.count; b++) {
      const count = Math.min(BLOCK, manifest.count - b * BLOCK);
      const records = await blockOf(await block(b), count, manifest);
      this.renderer.upload(splat, b, records);
      meansOfBlock(records, means, b * BLOCK);
      progress?.(count);
      await new Promise((resolve) => setTimeout(resolve));
    }
    splat.sorter = new Sorter(means);
    return splat;
  }

  say(text) {
    $("status").textContent = text;
  }

  describe() {
    const counts = this.manifest.splats.map((s) => `${s.count.toLocaleString("en")} Gaussians`);
    this.say(`${counts.join(" | ")}${this.note ? `\n${this.note}` : ""}`);
  }

  // A line of its own that the next one replaces.
  remark(text) {
    $("remark").textContent = text;
  }

  // Depth of what a pixel of a camera shows.
  depthAt(camera, pinhole, x, y) {
    return this.splats.length ? this.renderer.depth(this.splats[0], camera, pinhole, x, y, this.home, LEAST_COVER) : 0;
  }

  // The first splat in the order of another camera; that of ours is old then.
  async sortFor(camera) {
    const sorted = await this.splats[0].sorter.order({ eye: camera.eye, forward: camera.forward });
    this.renderer.setOrder(this.splats[0], sorted);
    this.moved();
  }

  // The light as the shader takes it: turned by the angle about the world's up.
  get light() {
    const { light, angle, exposure } = this.state;
    const axis = this.camera.up;
    const columns = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((e) => turned(e, axis, (-angle * Math.PI) / 180));
    const harmonics = this.manifest.lights[light]?.harmonics ?? new Array(75).fill(0);
    return { harmonics, lightFromWorld: columns.flat(), exposure: 2 ** exposure };
  }

  resetCamera() {
    this.camera = new Camera(this.manifest.up);
    const { start, center, photos } = this.manifest;
    if (photos.length) this.camera.take(this.photoCamera(photos[0]), center);
    else {
      this.camera.frame = start.pinhole;
      this.camera.lookAt(start.eye, center);
    }
    this.home = this.camera.distance;
    this.moved();
  }

  photoCamera(photo) {
    return { rotation: photo.rotation, eye: photo.eye, pinhole: photo.pinhole };
  }

  // The camera changed: what is drawn and its order are old.
  moved() {
    this.dirty = this.unsorted = true;
    this.lastMove = performance.now();
  }

  changed(values) {
    Object.assign(this.state, values);
    this.dirty = true;
    this.controls?.refresh();
  }

  look(view) {
    const photo = this.manifest.photos[view];
    if (!photo) return;
    this.camera.take(this.photoCamera(photo), this.manifest.center);
    this.state.view = view;
    this.note = photo.name;
    this.describe();
    this.moved();
    this.changed({ view });
  }

  // Whether the camera is exactly a photo's, so that the photo can lie over the picture.
  get atPhoto() {
    const photo = this.manifest.photos[this.state.view];
    return Boolean(photo) && this.camera.axes === photo.rotation && this.camera.eye === photo.eye;
  }

  async image(view) {
    if (!this.images[view]) {
      const image = new Image();
      image.src = this.source.photo(view);
      this.images[view] = image;
    }
    await this.images[view].decode();
    return this.images[view];
  }

  async sort() {
    const camera = { eye: this.camera.eye, forward: this.camera.forward };
    this.unsorted = false;
    const used = this.splats.slice(0, this.state.compare === "splat" ? 2 : 1);
    const orders = await Promise.all(used.map((splat) => splat.sorter.order(camera)));
    orders.forEach((sorted, s) => this.renderer.setOrder(used[s], sorted));
    this.sortedSplats = used.length;
    this.dirty = true;
  }

  tick(now) {
    this.controls?.keys(now);
    if (this.state.how === "flicker" && this.state.compare !== "none") {
      const phase = Math.floor(now / 600) % 2;
      if (phase !== this.phase) this.dirty = true;
      this.phase = phase;
    }
    const wants = this.state.compare === "splat" ? 2 : 1;
    const stale = this.unsorted || this.sortedSplats < Math.min(wants, this.splats.length);
    if (stale && !this.sorting) {
      this.sorting = true;
      this.sort().finally(() => (this.sorting = false));
    }
    // Half the resolution while moving, when a picture takes long; the full one at rest.
    const moving = now - this.lastMove < 250;
    const scale = moving && this.drawMs > 45 ? 0.5 : moving ? this.scale : 1;
    if (scale !== this.scale) {
      this.scale = scale;
      this.dirty = true;
    }
    if (this.dirty) {
      this.dirty = false;
      this.present();
    }
    this.pointer.tick(now);
  }

  // The parts of a picture `width` wide: left of the divider the mode, right of it what it is compared with.
  parts(width) {
    const { mode, compare, how, split } = this.state;
    const light = this.light;
    const [first, second] = this.splats;
    const other = compare === "splat" ? { splat: second, mode } : { splat: first, mode: compare };
    if (compare === "none" || compare === "photo" || !other.splat) return [{ splat: first, mode, light, columns: [0, width] }];
    const share = how === "flicker" ? this.phase : how === "slider" ? split : 1;
    const at = Math.round(width * share);
    return [
      { splat: first, mode, light, columns: [0, at] },
      { ...other, light, columns: [at, width] },
    ];
  }

  present() {
    const canvas = $("canvas");
    const ratio = (window.devicePixelRatio || 1) * this.scale;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const start = performance.now();
    const pinhole = this.camera.pinhole(width, height);
    this.renderer.draw(this.parts(width), this.camera, pinhole, this.background);
    this.renderer.present();
    // Reading one pixel waits for the picture: without it the time would be that of the commands.
    if (this.lastMove && start - this.lastMove < 250) {
      const gl = this.renderer.gl;
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      this.drawMs = (performance.now() - start) / this.scale;
    }
    this.overlay(pinhole.frame, ratio);
  }

  // The photo over the picture, and the divider.
  overlay(frame, ratio) {
    const { compare, how, split, view } = this.state;
    const photo = $("photo");
    const shows = compare === "photo" && this.atPhoto;
    photo.style.display = shows ? "block" : "none";
    if (shows) {
      this.image(view).then((image) => {
        if (photo.src !== image.src) photo.src = image.src;
      });
      const css = { left: frame.x, top: frame.y, width: frame.width, height: frame.height };
      for (const [key, value] of Object.entries(css)) photo.style[key] = `${value / ratio}px`;
      const share = how === "flicker" ? this.phase : how === "slider" ? (split * window.innerWidth - frame.x / ratio) / (frame.width / ratio) : 0;
      photo.style.clipPath = `inset(0 0 0 ${100 * Math.min(1, Math.max(0, share))}%)`;
      photo.style.mixBlendMode = how === "difference" ? "difference" : "normal";
    }
    const divided = how === "slider" && compare !== "none" && (compare !== "photo" || shows);
    $("divider").style.display = divided ? "block" : "none";
    $("divider").style.left = `${100 * split}%`;
  }

  // The picture of a photo's camera at the photo's size, RGBA bytes; for measuring.
  async pixels(view, mode = this.state.mode, splat = 0) {
    const photo = this.manifest.photos[view];
    const camera = new Camera(this.manifest.up);
    camera.take(this.photoCamera(photo), this.manifest.center);
    const { width, height } = photo.pinhole;
    const sorted = await this.splats[splat].sorter.order({ eye: camera.eye, forward: camera.forward });
    this.renderer.setOrder(this.splats[splat], sorted);
    const part = { splat: this.splats[splat], mode, light: this.light, columns: [0, width] };
    this.renderer.draw([part], camera, camera.pinhole(width, height), this.background);
    const bytes = this.renderer.pixels();
    this.moved(); // the order on the graphics processor is another camera's
    return { width, height, bytes };
  }

  // PSNR of a view against its photo as embedded, decibels.
  async psnr(view) {
    const { width, height, bytes } = await this.pixels(view, "appearance");
    const sheet = new OffscreenCanvas(width, height).getContext("2d");
    sheet.drawImage(await this.image(view), 0, 0, width, height);
    const truth = sheet.getImageData(0, 0, width, height).data;
    let sum = 0;
    for (let i = 0; i < bytes.length; i++) if (i % 4 < 3) sum += ((bytes[i] - truth[i]) / 255) ** 2;
    return -10 * Math.log10(sum / (width * height * 3));
  }
}
