// Where we look from: +x right, +y down, +z forward, a pinhole with lengths in pixels.

const add = (a, b, s = 1) => a.map((v, k) => v + s * b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const scaled = (a, s) => a.map((v) => v * s);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.hypot(...a);
const unit = (a) => scaled(a, 1 / (length(a) || 1));

// `v` turned about a unit axis (Rodrigues).
function turned(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(scaled(v, c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
}

class Camera {
  constructor(up) {
    this.up = unit(up);
    this.eye = [0, 0, 0];
    this.axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]; // right, down, forward in world
    this.target = [0, 0, 1];
    // A picture of `frame` pixels with this pinhole is fitted into the canvas.
    this.frame = { width: 4, height: 3, fx: 4, fy: 4, cx: 2, cy: 1.5 };
  }

  get forward() {
    return this.axes[2];
  }

  lookAt(eye, target) {
    const forward = unit(add(target, eye, -1));
    let right = cross(forward, this.up);
    if (length(right) < 1e-6) right = cross(forward, Math.abs(this.up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]);
    right = unit(right);
    Object.assign(this, { eye, target, axes: [right, cross(forward, right), forward] });
  }

  // Exactly the camera of a photo; turning continues about the scene.
  take(photo, center) {
    this.axes = photo.rotation; // rows of camera_from_world
    this.eye = photo.eye;
    this.frame = photo.pinhole;
    const ahead = dot(add(center, this.eye, -1), this.forward);
    const far = length(add(center, this.eye, -1));
    this.target = add(this.eye, this.forward, ahead > 0 ? ahead : Math.max(far, 1e-3));
  }

  // The pinhole on a canvas of this size: the frame is fitted into its middle.
  pinhole(width, height) {
    const f = this.frame;
    const s = Math.min(width / f.width, height / f.height);
    return {
      width, height, fx: s * f.fx, fy: s * f.fy,
      cx: width / 2 + s * (f.cx - f.width / 2),
      cy: height / 2 + s * (f.cy - f.height / 2),
      frame: { x: (width - s * f.width) / 2, y: (height - s * f.height) / 2, width: s * f.width, height: s * f.height },
    };
  }

  // Turns about the target (orbit) or about the eye (fly). Angles in radians.
  turn(yaw, pitch, fly) {
    // Never over the pole: the angle between forward and up stays within (3, 177) degrees.
    const angle = Math.acos(Math.max(-1, Math.min(1, dot(this.forward, this.up))));
    const least = Math.PI / 60;
    if (angle > least && angle < Math.PI - least) {
      pitch = Math.max(angle - Math.PI + least, Math.min(angle - least, pitch));
    }
    const right = this.axes[0];
    const turn = (v) => turned(turned(v, right, pitch), this.up, yaw);
    const arm = add(this.eye, this.target, -1);
    this.axes = this.axes.map((axis) => unit(turn(axis)));
    if (fly) this.target = add(this.eye, turn(arm), -1);
    else this.eye = add(this.target, turn(arm));
  }

  // Along right, down and forward, in world units.
  move(right, down, forward) {
    const step = add(add(scaled(this.axes[0], right), this.axes[1], down), this.forward, forward);
    this.eye = add(this.eye, step);
    this.target = add(this.target, step);
  }

  // Toward the target by a factor on the distance.
  dolly(factor) {
    this.eye = add(this.target, scaled(add(this.eye, this.target, -1), factor));
  }

  get distance() {
    return length(add(this.eye, this.target, -1));
  }
}
