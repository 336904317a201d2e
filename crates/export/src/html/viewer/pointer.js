// What the pointer is at: a point of the world, the pixel of a photo that shows it, and texts to paste into a command line.

// Least coverage that counts as something.
const LEAST_COVER = 0.5;
// Two depths of one point may differ by this share.
const SAME_DEPTH = 0.05;
// Photos that are asked whether they see a point.
const ASKED = 4;

class Pointer {
  constructor(viewer) {
    this.viewer = viewer;
    this.at = null; // where the mouse is, CSS pixels
    this.shown = null; // what is said about it
    this.poses = []; // marked for a camera path
    this.rest = 0; // when the next reading may happen
  }

  hover(at) {
    this.at = at;
    this.stale = true;
  }

  // Reads the depth under the mouse, no more often than the machine bears.
  tick(now) {
    if (!this.stale || now < this.rest || this.viewer.dirty) return;
    this.stale = false;
    const start = performance.now();
    this.shown = this.at && this.read(...this.at);
    this.rest = now + Math.max(60, 8 * (performance.now() - start));
    $("pointer").textContent = this.shown ? this.text(this.shown) : "";
  }

  // The point at a place of the window, and the pixel of a photo for it; null where nothing is.
  read(x, y) {
    const { viewer } = this;
    const canvas = $("canvas");
    const ratio = canvas.width / canvas.clientWidth;
    const pinhole = viewer.camera.pinhole(canvas.width, canvas.height);
    const pixel = [Math.floor(x * ratio), Math.floor(y * ratio)];
    const point = this.pointAt(viewer.camera, pinhole, pixel);
    if (!point) return null;
    const { photos } = viewer.manifest;
    if (viewer.atPhoto) {
      const photo = photos[viewer.state.view];
      return { point, photo, pixel: this.pixelOf(photo, point) ?? this.rounded(photo, [0, 0]) };
    }
    return { point, ...this.candidates(point)[0] };
  }

  pointAt(camera, pinhole, [x, y]) {
    const depth = this.viewer.depthAt(camera, pinhole, x, y);
    if (!(depth > 0)) return null;
    const [right, down, forward] = camera.axes;
    const u = (x + 0.5 - pinhole.cx) / pinhole.fx;
    const v = (y + 0.5 - pinhole.cy) / pinhole.fy;
    return add(add(add(camera.eye, right, u * depth), down, v * depth), forward, depth);
  }

  // The pixel of a photo, as the capture has it, that a point is on; null outside.
  pixelOf(photo, point) {
    const { pinhole: p } = photo;
    const arm = add(point, photo.eye, -1);
    const [x, y, z] = photo.rotation.map((axis) => dot(axis, arm));
    if (!(z > 0)) return null;
    const at = [(p.fx * x) / z + p.cx, (p.fy * y) / z + p.cy];
    return at[0] >= 0 && at[1] >= 0 && at[0] < p.width && at[1] < p.height ? this.rounded(photo, at) : null;
  }

  rounded(photo, [x, y]) {
    const { width, height } = photo.pinhole;
    const [w, h] = photo.size;
    return [Math.min(w - 1, Math.floor((x * w) / width)), Math.min(h - 1, Math.floor((y * h) / height))];
  }

  // Photos that have a point in their frame, those that look at it most as we do first.
  candidates(point) {
    const ours = unit(add(point, this.viewer.camera.eye, -1));
    return this.viewer.manifest.photos
      .map((photo) => ({ photo, pixel: this.pixelOf(photo, point), likeness: dot(unit(add(point, photo.eye, -1)), ours) }))
      .filter((found) => found.pixel)
      .sort((a, b) => b.likeness - a.likeness);
  }

  // The first photo in which nothing stands before the point.
  async unhidden(point) {
    const { viewer } = this;
    for (const found of this.candidates(point).slice(0, ASKED)) {
      const camera = new Camera(viewer.manifest.up);
      camera.take(viewer.photoCamera(found.photo), viewer.manifest.center);
      const { width, height } = found.photo.pinhole;
      const [w, h] = found.photo.size;
      await viewer.sortFor(camera);
      const at = [Math.floor((found.pixel[0] * width) / w), Math.floor((found.pixel[1] * height) / h)];
      const depth = viewer.depthAt(camera, camera.pinhole(width, height), ...at);
      const own = dot(add(point, camera.eye, -1), camera.forward);
      if (Math.abs(depth - own) < SAME_DEPTH * own) return found;
    }
    return null;
  }

  text({ point, photo, pixel }) {
    const world = point.map((v) => v.toPrecision(4)).join(", ");
    return `${photo ? `${photo.name},${pixel.join(",")}\n` : ""}X, Y, Z ${world}`;
  }

  // Copies what segment-select takes; the point for edit where no photo shows it.
  async click(x, y) {
    const found = this.read(x, y);
    if (!found) return this.viewer.remark("nothing is there");
    const seen = this.viewer.atPhoto ? found : await this.unhidden(found.point);
    const text = seen
      ? `--click ${quotedWord(`${seen.photo.name},${seen.pixel.join(",")}`)}`
      : `--at ${found.point.map((v) => v.toPrecision(6)).join(",")}`;
    return this.copy(text, text);
  }

  // The present pose, as docs/formats/camera-path.md has it.
  pose() {
    const { axes, eye, frame } = this.viewer.camera;
    return {
      camera_from_world: {
        rotation_wxyz: quaternionOf(axes),
        translation: axes.map((axis) => -dot(axis, eye)),
      },
      vertical_fov_deg: (2 * Math.atan(frame.height / 2 / frame.fy) * 180) / Math.PI,
    };
  }

  mark() {
    this.poses.push(this.pose());
    this.viewer.remark(`${this.poses.length} poses marked`);
  }

  // The marked poses, or the present one.
  path() {
    const poses = this.poses.length ? this.poses : [this.pose()];
    const { width, height } = this.viewer.camera.frame;
    return { format: "motes/camera-path", version: "1.0", width, height, fps: 30, vertical_fov_deg: poses[0].vertical_fov_deg, poses };
  }

  async copyPath() {
    const path = this.path();
    await this.copy(JSON.stringify(path, null, 1), `camera-path.json with ${path.poses.length} poses`);
    this.poses = [];
  }

  // A page from a file may lack the clipboard's interface; the old command works there.
  async copy(text, name) {
    this.copied = text;
    let done = true;
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      const field = Object.assign(document.createElement("textarea"), { value: text });
      document.body.append(field);
      field.select();
      done = document.execCommand("copy");
      field.remove();
    }
    this.viewer.remark(done ? `copied: ${name}` : text);
  }
}

// A word for a shell.
function quotedWord(text) {
  return /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`;
}

// Unit quaternion w, x, y, z of a matrix by its rows (Shepperd 1978).
function quaternionOf([a, b, c]) {
  const squares = [
    1 + a[0] + b[1] + c[2],
    1 + a[0] - b[1] - c[2],
    1 - a[0] + b[1] - c[2],
    1 - a[0] - b[1] + c[2],
  ];
  const k = squares.indexOf(Math.max(...squares));
  const rows = [
    [squares[0], c[1] - b[2], a[2] - c[0], b[0] - a[1]],
    [c[1] - b[2], squares[1], b[0] + a[1], a[2] + c[0]],
    [a[2] - c[0], b[0] + a[1], squares[2], c[1] + b[2]],
    [b[0] - a[1], a[2] + c[0], c[1] + b[2], squares[3]],
  ];
  return unit(rows[k]);
}
