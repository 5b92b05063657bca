// A camera that turns round a point. Places are in metres from the lower corner of the box round the particles.

const ANGLE = Math.tan((15 * Math.PI) / 180); // half of the height that it sees at a distance of 1

const add = (a, b, factor = 1) => a.map((x, i) => x + factor * b[i]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

// In space z points up and the front is seen along +y; in the plane y points up.
const [FRONT, RIGHT, UP] = meta.dimension === 3 ? [[0, -1, 0], [1, 0, 0], [0, 0, 1]] : [[0, 0, 1], [1, 0, 0], [0, 1, 0]];
// Angles to the right and up, degrees.
const VIEWS =
  meta.dimension === 3
    ? { iso: [35, 28], front: [0, 0], right: [90, 0], back: [180, 0], left: [-90, 0], top: [0, 90] }
    : { front: [0, 0], iso: [35, 28] };

class Camera {
  constructor() {
    this.perspective = meta.dimension === 3;
    this.target = [0, 0, 0];
    this.distance = 1;
    this.look(Object.keys(VIEWS)[0]);
  }

  look(view) {
    [this.yaw, this.pitch] = VIEWS[view].map((angle) => (angle * Math.PI) / 180);
  }

  // Looks at a box so that all of it is seen in a window of so many pixels, inside margins: left, right, top, bottom.
  fit(low, high, width, height, [left, rightMost, top, bottom]) {
    this.target = low.map((x, axis) => (x + high[axis]) / 2);
    const { right, up, back } = this.axes();
    const [wide, tall] = [Math.max(width - left - rightMost, 50) / height, Math.max(height - top - bottom, 50) / height];
    let distance = 0;
    for (let corner = 0; corner < 8; corner++) {
      const from = [0, 1, 2].map((axis) => (corner & (1 << axis) ? high : low)[axis] - this.target[axis]);
      const across = Math.max(Math.abs(dot(from, right)) / wide, Math.abs(dot(from, up)) / tall) / ANGLE;
      distance = Math.max(distance, across + (this.perspective ? dot(from, back) : 0));
    }
    this.distance = distance || 1;
    this.move((left - rightMost) / 2 / height, (top - bottom) / 2 / height);
  }

  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    const round = add(FRONT.map((x) => cy * x), RIGHT, sy);
    const back = add(round.map((x) => cp * x), UP, sp);
    const right = add(RIGHT.map((x) => cy * x), FRONT, -sy);
    return { right, back, up: cross(back, right) };
  }

  turn(dx, dy) {
    this.yaw -= dx;
    this.pitch = Math.min(Math.max(this.pitch + dy, -Math.PI / 2), Math.PI / 2);
  }

  // Moves by parts of the height of the window.
  move(dx, dy) {
    const { right, up } = this.axes();
    const height = 2 * ANGLE * this.distance;
    this.target = add(add(this.target, right, -dx * height), up, dy * height);
  }

  zoom(factor) {
    this.distance *= factor;
  }

  // From places to the cube of the screen, by columns; and pixels for a metre at unit depth.
  matrix(width, height) {
    const { right, up, back } = this.axes();
    const eye = add(this.target, back, this.distance);
    const reach = this.distance + 2 * this.depth;
    const near = this.perspective ? Math.max(this.distance - 2 * this.depth, this.distance * 0.02) : -reach;
    const scale = this.perspective ? 1 / ANGLE : 1 / (ANGLE * this.distance);
    // Depth: z' = a z + b, over w in perspective, where z is that behind the eye.
    const [a, b] = this.perspective
      ? [(near + reach) / (near - reach), (2 * near * reach) / (near - reach)]
      : [-2 / (reach - near), -(reach + near) / (reach - near)];
    const rows = [
      [...right.map((x) => (x * scale * height) / width), (-dot(right, eye) * scale * height) / width],
      [...up.map((x) => x * scale), -dot(up, eye) * scale],
      [...back.map((x) => x * a), -dot(back, eye) * a + b],
      this.perspective ? [...back.map((x) => -x), dot(back, eye)] : [0, 0, 0, 1],
    ];
    const matrix = new Float32Array(16);
    rows.forEach((row, i) => row.forEach((x, j) => (matrix[4 * j + i] = x)));
    return { matrix, pixels: (scale * height) / 2, project: (place) => project(rows, place, width, height) };
  }
}

// Place on the screen, pixels from the upper left corner, and depth.
function project(rows, place, width, height) {
  const [x, y, z, w] = rows.map((row) => dot(row, place) + row[3]);
  return { x: (0.5 + x / w / 2) * width, y: (0.5 - y / w / 2) * height, depth: z / w, ahead: w > 0 };
}
