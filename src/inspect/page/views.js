// The three views: where they are on the page, how they are drawn, and what mouse and keys do there.

import * as camera from "inspect/camera";
import { LAYERS, isThere, legend, paint } from "inspect/colours";
import { byId, css, fixed, h, plain, say } from "inspect/dom";
import { drawOver, lines, pixelOf } from "inspect/overlay";
import { Scene } from "inspect/scene";
import { instanceOf, on, picture, position, select, slots, state, tell } from "inspect/state";

const VIEWS = ["space", "plane", "range"];
// Height of what stands above the range image.
const BAR = 30;
let scene, context, cursor = null;
// The views that have to be drawn; the others stay as they are.
const toDraw = new Set();
const painted = { A: null, B: null };
// What was measured of the last frames: for people who ask, and for tests.
export const measured = { draws: 0, drawMs: 0, firstPicture: null };

export function start() {
  scene = new Scene(byId("gl"), state.session.colours.panel);
  scene.onRestored = () => { if (state.points) scene.setPoints(state.points.position); repaint(); };
  context = byId("overlay").getContext("2d");
  for (const element of [document.body, ...VIEWS.map(byId)]) new ResizeObserver(() => due()).observe(element);
  on("points", () => scene.setPoints(state.points.position));
  on("picture selection layer shown compare", repaint);
  on("explanation view", () => due());
  VIEWS.forEach(listen);
  toggles();
  layers();
}

// Draws some views at the next frame of the screen; all if none is named.
export function due(...views) {
  const isDue = toDraw.size > 0;
  for (const view of views.length ? views : VIEWS) toDraw.add(view);
  if (!isDue) requestAnimationFrame(draw);
}

function repaint() {
  for (const slot of slots()) {
    if (!state.pictures[slot]) continue;
    const { run, arrays } = state.pictures[slot];
    painted[slot] = paint(slot, painted[slot]);
    scene.setColours(slot, painted[slot], run, arrays.point_of_pixel);
    scene.setLines(slot, ...lines(slot));
  }
  legends();
  layers();
  toggles();
  due();
}

// The panes of a view: two, where two settings are compared.
export function panes(view) {
  const outer = byId(view).getBoundingClientRect(), all = slots();
  const bar = view === "range" ? BAR : 0;
  const box = { left: outer.left, top: outer.top + bar, width: outer.width, height: outer.height - bar };
  const beside = view === "space" && box.width > box.height;
  return all.map((slot, n) => {
    const area = { x: box.left, y: box.top, width: box.width, height: box.height };
    if (all.length === 2) {
      if (beside) Object.assign(area, { width: box.width / 2 - 1, x: box.left + (n * box.width) / 2 + n });
      else Object.assign(area, { height: box.height / 2 - 1, y: box.top + (n * box.height) / 2 + n });
    }
    return { view, slot, area };
  });
}

function matrixOf({ view, area }) {
  if (view === "space") return camera.spaceMatrix(area.width / area.height);
  return view === "plane" ? camera.planeMatrix(area.width / area.height) : null;
}

function draw() {
  const views = [...toDraw];
  toDraw.clear();
  const began = performance.now(), ratio = Math.min(window.devicePixelRatio || 1, 2);
  const [width, height] = [innerWidth, innerHeight].map((side) => Math.round(side * ratio));
  const overlay = byId("overlay"), isAll = views.length === VIEWS.length;
  scene.begin(width, height, isAll);
  if (overlay.width !== width || overlay.height !== height) Object.assign(overlay, { width, height });
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (isAll) context.clearRect(0, 0, innerWidth, innerHeight);
  const many = (scene.count ?? 0) > 400000;
  for (const pane of views.flatMap(panes)) {
    if (pane.area.width < 2 || pane.area.height < 2) continue;
    const scaled = Object.fromEntries(Object.entries(pane.area).map(([name, side]) => [name, Math.round(side * ratio)]));
    const matrix = matrixOf(pane);
    if (pane.view === "range") scene.drawImage(pane.slot, scaled, camera.range);
    else {
      const near = pane.view === "plane" ? Math.min(Math.max(40 / camera.plane.metres, 0.7), 2) : Math.min(Math.max(30 / camera.space.distance, 0.8), 2);
      const sizes = (many ? [1, 1, 3] : [1.2 * near, 2 * near, 3.2 * near]).map((size) => Math.max(1, size * ratio));
      scene.drawPoints(pane.slot, scaled, matrix, sizes, true);
    }
    context.clearRect(pane.area.x, pane.area.y, pane.area.width, pane.area.height);
    drawOver(context, pane, matrix, document.activeElement === byId("range") ? cursor : null);
  }
  measured.draws += 1;
  measured.drawMs = performance.now() - began;
  if (!measured.firstPicture && picture()) measured.firstPicture = performance.now();
}

// How long the cloud takes to be drawn as it turns, until the graphics unit is done: the median.
export function measureDraw(times = 20) {
  const gl = scene.gl, pixel = new Uint8Array(4), took = [];
  for (let n = 0; n < times; n++) {
    camera.turn(3, 0);
    toDraw.add("space");
    const began = performance.now();
    draw();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    took.push(performance.now() - began);
  }
  return took.sort((a, b) => a - b)[times >> 1];
}

// A picture of the views as they are.
export function snapshot() {
  VIEWS.forEach((view) => toDraw.add(view));
  draw();
  const { width, height } = scene.canvas, whole = h("canvas", { width, height }), out = whole.getContext("2d");
  out.fillStyle = getComputedStyle(document.body).backgroundColor;
  out.fillRect(0, 0, width, height);
  out.drawImage(scene.canvas, 0, 0);
  out.drawImage(byId("overlay"), 0, 0);
  return new Promise((resolve) => whole.toBlob(resolve, "image/png"));
}

// --- what mouse and keys do

function paneAt(view, x, y) {
  return panes(view).find(({ area }) => x >= area.x && x < area.x + area.width && y >= area.y && y < area.y + area.height) ?? panes(view)[0];
}

function pixelAt({ area, slot }, x, y) {
  const { rows, columns, top_row_first: topFirst } = state.pictures[slot].run, { range } = camera;
  const u = ((x - area.x) / area.width - 0.5) / range.zoom + range.x, v = ((y - area.y) / area.height - 0.5) / range.zoom + range.y;
  const [row, column] = [Math.floor(v * rows), Math.floor(u * columns)];
  return [topFirst ? row : rows - 1 - row, column].map((n, axis) => Math.min(Math.max(n, 0), (axis ? columns : rows) - 1));
}

// The point in a pixel, or in the nearest one that has some, as far as a finger is wide.
function pointInPixel(slot, [row, column], reach = 3) {
  const { run, arrays } = state.pictures[slot];
  let best = null;
  for (let r = row - reach; r <= row + reach; r++) for (let c = column - reach; c <= column + reach; c++) {
    if (r < 0 || c < 0 || r >= run.rows || c >= run.columns) continue;
    const point = arrays.point_of_pixel[r * run.columns + c], away = Math.hypot(r - row, c - column);
    if (point !== 0xffffffff && (best === null || away < best.away)) best = { point, away };
  }
  return best?.point ?? null;
}

// The point that is drawn nearest to a place: of two the one in front.
export function pick(view, x, y) {
  if (!picture()) return null;
  const pane = paneAt(view, x, y);
  if (view === "range") return pointInPixel(pane.slot, pixelAt(pane, x, y));
  const { area, slot } = pane, m = matrixOf(pane), at = state.points.position, colours = painted[slot];
  const REACH = 9;
  const [tx, ty] = [((x - area.x) / area.width) * 2 - 1, 1 - ((y - area.y) / area.height) * 2];
  const [rx, ry] = [(2 * REACH) / area.width, (2 * REACH) / area.height];
  let best = null, least = Infinity;
  for (let n = 0, k = 0; k < at.length; n++, k += 3) {
    if (!colours[4 * n + 3]) continue;
    const X = at[k], Y = at[k + 1], Z = at[k + 2], w = m[3] * X + m[7] * Y + m[11] * Z + m[15];
    if (w <= 0) continue;
    const dx = ((m[0] * X + m[4] * Y + m[8] * Z + m[12]) / w - tx) / rx, dy = ((m[1] * X + m[5] * Y + m[9] * Z + m[13]) / w - ty) / ry;
    const away = dx * dx + dy * dy;
    if (away > 1) continue;
    const depth = (m[2] * X + m[6] * Y + m[10] * Z + m[14]) / w, cost = away + (view === "space" ? 60 * (depth + 1) : depth + 1);
    if (cost < least) { least = cost; best = n; }
  }
  return best;
}

function describe(point, slot) {
  const { arrays } = state.pictures[slot], id = arrays.instance[point], [x, y, z] = position(point);
  const what = id ? (instanceOf(id, slot)?.title ?? id) : state.session.colours.reason_words[arrays.reason[point]];
  return `${what}  ·  ${fixed(x, 2)}, ${fixed(y, 2)}, ${fixed(z, 2)} m  ·  point ${point}`;
}

function move(view, dx, dy, isShift) {
  const { area } = panes(view)[0], { plane, range } = camera;
  if (view === "space") (isShift ? camera.shift(dx, dy, area.height) : camera.turn(dx, dy));
  else if (view === "plane") { plane.x -= (dx / area.width) * plane.metres; plane.y += (dy / area.width) * plane.metres; }
  else { range.x -= dx / area.width / range.zoom; range.y -= dy / area.height / range.zoom; camera.holdRange(); }
  due(view);
}

function zoom(view, factor, x, y) {
  const pane = x === undefined ? panes(view)[0] : paneAt(view, x, y), { area } = pane;
  const [u, v] = x === undefined ? [0.5, 0.5] : [(x - area.x) / area.width, (y - area.y) / area.height];
  const { plane, range } = camera;
  if (view === "space") camera.zoomSpace(factor);
  else if (view === "plane") camera.zoomPlane(factor, [plane.x + (u - 0.5) * plane.metres, plane.y - ((v - 0.5) * plane.metres * area.height) / area.width]);
  else camera.zoomRange(1 / factor, [range.x + (u - 0.5) / range.zoom, range.y + (v - 0.5) / range.zoom]);
  due(view);
}

function listen(view) {
  const element = byId(view);
  let held = null;
  const isView = (event) => !event.target.closest("button");
  element.addEventListener("pointerdown", (event) => {
    if (!isView(event)) return;
    element.setPointerCapture(event.pointerId);
    held = { x: event.clientX, y: event.clientY, moved: 0, shift: event.shiftKey || event.button > 0 };
  });
  element.addEventListener("pointermove", (event) => {
    if (held) {
      const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
      held.moved += Math.hypot(dx, dy);
      Object.assign(held, { x: event.clientX, y: event.clientY });
      if (held.moved > 4) move(view, dx, dy, held.shift);
    } else if (view === "range" && picture() && isView(event)) {
      const point = pick(view, event.clientX, event.clientY);
      if (point !== null) say(describe(point, paneAt(view, event.clientX, event.clientY).slot));
    }
  });
  element.addEventListener("pointerup", (event) => {
    if (held && held.moved <= 4 && event.button === 0) choose(view, event.clientX, event.clientY, event.shiftKey || state.selected.length === 1);
    held = null;
  });
  element.addEventListener("pointercancel", () => { held = null; });
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(view, Math.exp(Math.max(-1, Math.min(1, event.deltaY / 240)) * 0.5), event.clientX, event.clientY);
  }, { passive: false });
  element.addEventListener("dblclick", (event) => isView(event) && home());
  element.addEventListener("keydown", (event) => key(view, event));
  element.addEventListener("focus", () => due(view));
  element.addEventListener("blur", () => due(view));
}

// Selects what is at a place: a second point beside a first one.
function choose(view, x, y, isSecond) {
  const point = pick(view, x, y);
  if (point === null) return say("no point is there");
  const pane = paneAt(view, x, y);
  if (state.compare && pane.slot !== state.slot) { state.slot = pane.slot; tell("slot"); }
  select(point, isSecond);
  say(describe(point, pane.slot));
}

export function home() {
  if (state.points) camera.lookAtAll(state.points.position);
  due();
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function key(view, event) {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target !== event.currentTarget) return;
  const arrow = ARROWS[event.key];
  if (arrow && view === "range") moveCursor(arrow, event.shiftKey ? 10 : 1);
  else if (arrow) move(view, -arrow[0] * 40, -arrow[1] * 40, event.shiftKey);
  else if (event.key === "+" || event.key === "=") zoom(view, 0.8);
  else if (event.key === "-") zoom(view, 1.25);
  else if (event.key === "0") home();
  else if (event.key === "Enter" && view === "range" && cursor) {
    const point = pointInPixel(state.slot, cursor);
    if (point !== null) select(point, event.shiftKey);
  } else if (event.key === "Enter") {
    const { area } = panes(view)[0];
    choose(view, area.x + area.width / 2, area.y + area.height / 2, event.shiftKey);
  } else return;
  event.preventDefault();
  event.stopPropagation();
}

function moveCursor([dx, dy], by) {
  if (!picture()) return;
  const { rows, columns, top_row_first: topFirst } = picture().run;
  cursor ??= (state.selected.length && pixelOf(state.selected[0], state.slot)) || [rows >> 1, columns >> 1];
  const row = Math.min(Math.max(cursor[0] + (topFirst ? dy : -dy) * by, 0), rows - 1);
  cursor = [row, (cursor[1] + dx * by + columns) % columns];
  const point = pointInPixel(state.slot, cursor);
  say(point === null ? `row ${cursor[0]}, column ${cursor[1]}: nothing there` : describe(point, state.slot));
  due("range");
}

// Looks at what is selected.
export function showSelected() {
  const one = instanceOf(state.instance), at = state.selected.length ? position(state.selected[0]) : one?.centre;
  if (!at || !at.every(Number.isFinite)) return home();
  camera.lookAt(at, one ? Math.max(...one.size) : 4);
  const pixel = state.selected.length ? pixelOf(state.selected[0], state.slot) : null;
  if (pixel) {
    const { rows, columns, top_row_first: topFirst } = picture().run;
    Object.assign(camera.range, { x: pixel[1] / columns, y: (topFirst ? pixel[0] : rows - pixel[0]) / rows, zoom: 4 });
    camera.holdRange();
    cursor = pixel;
  }
  due();
}

// --- what stands beside them

function layers() {
  const group = byId("layers");
  if (!group.children.length) {
    group.append(...LAYERS.map(([name, words], n) => h("button", { type: "button", role: "radio", "data-layer": name, onclick: () => setLayer(name), onkeydown: stepLayer }, h("kbd", {}, String(n + 1)), words)));
  }
  for (const button of group.children) {
    const { layer } = button.dataset, isOn = layer === state.layer;
    button.setAttribute("aria-checked", String(isOn));
    button.tabIndex = isOn ? 0 : -1;
    button.disabled = !isThere(layer);
  }
}

function stepLayer(event) {
  const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (!by) return;
  const there = [...byId("layers").children].filter((button) => !button.disabled);
  const next = there[(there.indexOf(event.currentTarget) + by + there.length) % there.length];
  setLayer(next.dataset.layer);
  next.focus();
  event.preventDefault();
}

export function setLayer(name) {
  if (!isThere(name)) return say("there is nothing to show in that layer");
  state.layer = name;
  tell("layer");
}

const SHOWN = [["boxes", "o"], ["ids", "i"], ["votes", "v"]];
function toggles() {
  const group = document.querySelector(".toggles");
  if (!group.children.length) {
    group.append(...SHOWN.map(([name, letter]) => h("button", { type: "button", onclick: () => toggle(name) }, h("kbd", {}, letter), name)));
  }
  SHOWN.forEach(([name], n) => group.children[n].setAttribute("aria-pressed", String(state.shown[name])));
}

export function toggle(name) {
  state.shown[name] = !state.shown[name];
  tell("shown");
}

function legends() {
  const rows = legend().map(([colour, words, ...rest]) => {
    if (colour === "ramp") {
      const canvas = h("canvas", { width: 256, height: 1 }), out = canvas.getContext("2d");
      words.forEach((one, n) => { out.fillStyle = css(one); out.fillRect(Math.round(255 * (n / 255) ** 2), 0, 256, 1); });
      return h("li", {}, rest[0], canvas, rest[1]);
    }
    const sign = h("i");
    if (colour) sign.style.background = css(colour);
    return h("li", {}, colour ? sign : null, plain(words));
  });
  document.querySelector(".legend").replaceChildren(...rows);
}
