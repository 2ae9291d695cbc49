// Where the views look from: matrices by columns, as WebGL takes them.

export const space = { target: [0, 0, 0], distance: 40, azimuth: -2.2, elevation: 0.62, fov: 0.9 };
export const plane = { x: 0, y: 0, metres: 80 };
// The part of the range image: its middle, and how many times it is enlarged.
export const range = { x: 0.5, y: 0.5, zoom: 1 };

const normal = (v) => {
  const n = Math.hypot(...v) || 1;
  return v.map((x) => x / n);
};
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export function eye() {
  const { target, distance, azimuth, elevation } = space;
  const level = Math.cos(elevation) * distance;
  return [
    target[0] + level * Math.cos(azimuth),
    target[1] + level * Math.sin(azimuth),
    target[2] + Math.sin(elevation) * distance,
  ];
}

// The directions of the screen in space: to the right, up, and towards the eye.
export function axes() {
  const back = normal(eye().map((x, n) => x - space.target[n]));
  const right = normal(cross([0, 0, 1], back));
  return { right, up: cross(back, right), back };
}

export function spaceMatrix(aspect) {
  const { right, up, back } = axes(),
    at = eye();
  const f = 1 / Math.tan(space.fov / 2),
    near = Math.max(space.distance / 200, 0.05),
    far = space.distance * 10 + 500;
  const view = [
    right[0],
    up[0],
    back[0],
    0,
    right[1],
    up[1],
    back[1],
    0,
    right[2],
    up[2],
    back[2],
    0,
    -dot(right, at),
    -dot(up, at),
    -dot(back, at),
    1,
  ];
  const [z, w] = [(far + near) / (near - far), (2 * far * near) / (near - far)];
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    const [x, y, d, one] = view.slice(4 * c, 4 * c + 4);
    out.set([(f / aspect) * x, f * y, z * d + w * one, -d], 4 * c);
  }
  return out;
}

// x to the right, y up; of points above each other the higher is seen.
export function planeMatrix(aspect) {
  const sx = 2 / plane.metres,
    sy = sx * aspect,
    sz = -1 / 200;
  return new Float32Array([
    sx,
    0,
    0,
    0,
    0,
    sy,
    0,
    0,
    0,
    0,
    sz,
    0,
    -plane.x * sx,
    -plane.y * sy,
    0,
    1,
  ]);
}

// A place in metres in a view from -1 to 1, with what it is divided by: not in sight unless above 0.
export function project(m, [x, y, z]) {
  const w = m[3] * x + m[7] * y + m[11] * z + m[15];
  return [
    (m[0] * x + m[4] * y + m[8] * z + m[12]) / w,
    (m[1] * x + m[5] * y + m[9] * z + m[13]) / w,
    w,
  ];
}

export function turn(dx, dy) {
  space.azimuth -= dx * 0.006;
  space.elevation = Math.min(Math.max(space.elevation + dy * 0.006, -1.5), 1.55);
}

export function shift(dx, dy, height) {
  const { right, up } = axes(),
    scale = (2 * space.distance * Math.tan(space.fov / 2)) / height;
  space.target = space.target.map((x, n) => x - right[n] * dx * scale + up[n] * dy * scale);
}

export const zoomSpace = (factor) => {
  space.distance = Math.min(Math.max(space.distance * factor, 0.3), 4000);
};

export function zoomPlane(factor, at = [plane.x, plane.y]) {
  const before = plane.metres;
  plane.metres = Math.min(Math.max(before * factor, 0.5), 20000);
  const kept = plane.metres / before;
  plane.x = at[0] + (plane.x - at[0]) * kept;
  plane.y = at[1] + (plane.y - at[1]) * kept;
}

export function zoomRange(factor, [x, y] = [range.x, range.y]) {
  const before = range.zoom;
  range.zoom = Math.min(Math.max(before * factor, 1), 64);
  const kept = before / range.zoom;
  range.x = x + (range.x - x) * kept;
  range.y = y + (range.y - y) * kept;
  holdRange();
}

// The part stays within the image.
export function holdRange() {
  const half = 0.5 / range.zoom;
  range.x = Math.min(Math.max(range.x, half), 1 - half);
  range.y = Math.min(Math.max(range.y, half), 1 - half);
}

// Looks at a place in metres.
export function lookAt([x, y, z], size = 8) {
  space.target = [x, y, z];
  space.distance = Math.max(size * 2.2, 6);
  Object.assign(plane, { x, y, metres: Math.max(size * 4, 14) });
}

// Looks at a whole cloud, but for its farthest points.
export function lookAtAll(positions) {
  const ranges = [];
  const every = Math.max(1, Math.floor(positions.length / 3 / 20000));
  for (let n = 0; n < positions.length; n += 3 * every) {
    const r = Math.hypot(positions[n], positions[n + 1]);
    if (r > 0 && r < Infinity) ranges.push([r, positions[n], positions[n + 1], positions[n + 2]]);
  }
  const middle = (axis) => {
    const all = ranges.map((one) => one[axis]).sort((a, b) => a - b);
    return all[all.length >> 1] ?? 0;
  };
  const centre = [middle(1), middle(2), middle(3)];
  const spread = ranges
    .map(([, x, y]) => Math.hypot(x - centre[0], y - centre[1]))
    .sort((a, b) => a - b);
  const reach = Math.max(spread[Math.floor(spread.length * 0.9)] ?? 20, 2);
  space.target = centre;
  space.distance = reach * 1.6;
  Object.assign(plane, { x: centre[0], y: centre[1], metres: reach * 2.4 });
  Object.assign(range, { x: 0.5, y: 0.5, zoom: 1 });
}
