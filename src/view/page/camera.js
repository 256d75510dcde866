// A camera as --camera has it, and how it moves. Vectors are arrays of three numbers.

const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const length = (a) => Math.sqrt(dot(a, a));
const unit = (a) => scaled(a, 1 / (length(a) || 1));

function rotated(v, axis, angle) {
  const c = Math.cos(angle), s = Math.sin(angle);
  return add(add(scaled(v, c), cross(axis, v), s), axis, (1 - c) * dot(axis, v));
}

function shortest(number) {
  const float = Math.fround(number);
  for (let digits = 1; digits < 9; digits++) {
    const text = float.toPrecision(digits);
    if (Math.fround(Number(text)) === float) return String(Number(text));
  }
  return String(Number(float.toPrecision(9)));
}

export class Camera {
  // text: ten numbers, perhaps ",mirrored", perhaps ",lens,RADIUS,DISTANCE".
  static parse(text) {
    const words = text.split(",");
    const numbers = words.slice(0, 10).map(Number);
    if (numbers.length < 10 || numbers.some((n) => !Number.isFinite(n))) return null;
    const camera = new Camera();
    camera.eye = numbers.slice(0, 3);
    camera.target = numbers.slice(3, 6);
    camera.up = numbers.slice(6, 9);
    camera.fov = numbers[9];
    camera.rest = words.slice(10);
    camera.said = text;
    return camera;
  }

  get mirrored() { return this.rest.includes("mirrored"); }
  get forward() { return unit(add(this.target, this.eye, -1)); }
  get distance() { return length(add(this.target, this.eye, -1)); }
  get right() { return scaled(unit(cross(this.forward, this.up)), this.mirrored ? -1 : 1); }
  // Of the picture; it may lean from that of the world.
  get upward() { return scaled(cross(this.right, this.forward), this.mirrored ? -1 : 1); }

  // As it was said, to the last digit, until it moves.
  text() { return this.said ?? this.rounded(); }

  // In single precision, as short as it can be said.
  rounded() {
    return [...this.eye, ...this.target, ...this.up, this.fov].map(shortest).concat(this.rest).join(",");
  }

  copy() { return Object.assign(new Camera(), this); }

  // Angles in radians: about the upright axis, and towards it. Never quite to the poles, where left and right change places.
  orbit(turn, tilt) {
    const axis = unit(this.up);
    const sense = this.mirrored ? -1 : 1;
    let arm = add(this.eye, this.target, -1);
    const height = Math.acos(Math.min(1, Math.max(-1, dot(unit(arm), axis))));
    const allowed = Math.min(Math.PI - 0.02, Math.max(0.02, height - tilt)) - height;
    const side = unit(cross(axis, arm));
    if (length(cross(axis, unit(arm))) > 1e-4) arm = rotated(arm, side, allowed);
    arm = rotated(arm, axis, -turn * sense);
    this.put(add(this.target, arm), this.target);
  }

  // In parts of the shorter side of the picture, at the distance of the target.
  pan(x, y) {
    const size = 2 * this.distance * Math.tan((this.fov * Math.PI) / 360);
    this.shift(add(scaled(this.right, -x * size), this.upward, y * size));
  }

  zoom(factor) { this.put(add(this.target, scaled(add(this.eye, this.target, -1), factor)), this.target); }

  // In lengths of the scene, along the picture's axes.
  fly(right, up, ahead) { this.shift(add(add(scaled(this.right, right), this.upward, up), this.forward, ahead)); }

  shift(by) { this.put(add(this.eye, by), add(this.target, by)); }

  put(eye, target) {
    this.eye = eye;
    this.target = target;
    this.said = null;
  }

  lookAt(point) {
    const ahead = dot(add(point, this.eye, -1), this.forward);
    if (ahead > 0) this.put(this.eye, point);
  }

  // Where a picture of this shape has a point, in its own units from the left and the top, with how far ahead it is.
  project(point, width, height) {
    const v = add(point, this.eye, -1);
    const ahead = dot(v, this.forward);
    const scale = Math.min(width, height) / (2 * Math.tan((this.fov * Math.PI) / 360));
    return { x: width / 2 + (dot(v, this.right) / ahead) * scale, y: height / 2 - (dot(v, this.upward) / ahead) * scale, ahead };
  }

  // The point that a pixel shows at this depth.
  pointAt(x, y, depth, width, height) {
    const scale = Math.min(width, height) / (2 * Math.tan((this.fov * Math.PI) / 360));
    const aside = add(scaled(this.right, (x - width / 2) / scale), this.upward, (height / 2 - y) / scale);
    return add(this.eye, add(this.forward, aside), depth);
  }
}
