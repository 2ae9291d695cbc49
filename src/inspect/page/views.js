// The three views: where they are on the page, and how they are drawn.

import * as camera from "inspect/camera";
import { LAYERS, isThere, legend, paint } from "inspect/colours";
import { byId, css, h, plain, say } from "inspect/dom";
import { drawOver, lines, pixelOf } from "inspect/overlay";
import { Scene } from "inspect/scene";
import { instanceOf, on, picture, position, slots, state, tell } from "inspect/state";

export const VIEWS = ["space", "plane", "range"];
// Height of what stands above the range image.
const BAR = 30;
let scene, context;
// The views that have to be drawn; the others stay as they are.
const toDraw = new Set();
// The colours of the points of each slot.
export const painted = { A: null, B: null };
// What was measured of the last frames: for people who ask, and for tests.
export const measured = { draws: 0, drawMs: 0, firstPicture: null };

export function start() {
  scene = new Scene(byId("gl"), state.session.colours.panel);
  scene.onRestored = () => {
    if (state.points) scene.setPoints(state.points.position);
    repaint();
  };
  context = byId("overlay").getContext("2d");
  for (const element of [document.body, ...VIEWS.map(byId)])
    new ResizeObserver(() => due()).observe(element);
  on("points", () => scene.setPoints(state.points.position));
  on("picture selection layer shown compare explanation node", repaint);
  on("view", () => due());
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
  const outer = byId(view).getBoundingClientRect(),
    all = slots();
  const bar = view === "range" ? BAR : 0;
  const box = {
    left: outer.left,
    top: outer.top + bar,
    width: outer.width,
    height: outer.height - bar,
  };
  const beside = view === "space" && box.width > box.height;
  return all.map((slot, n) => {
    const area = { x: box.left, y: box.top, width: box.width, height: box.height };
    if (all.length === 2) {
      if (beside)
        Object.assign(area, { width: box.width / 2 - 1, x: box.left + (n * box.width) / 2 + n });
      else
        Object.assign(area, { height: box.height / 2 - 1, y: box.top + (n * box.height) / 2 + n });
    }
    return { view, slot, area };
  });
}

export function matrixOf({ view, area }) {
  if (view === "space") return camera.spaceMatrix(area.width / area.height);
  return view === "plane" ? camera.planeMatrix(area.width / area.height) : null;
}

function draw() {
  const views = [...toDraw];
  toDraw.clear();
  const began = performance.now(),
    ratio = Math.min(window.devicePixelRatio || 1, 2);
  const [width, height] = [innerWidth, innerHeight].map((side) => Math.round(side * ratio));
  const overlay = byId("overlay"),
    isAll = views.length === VIEWS.length;
  scene.begin(width, height, isAll);
  if (overlay.width !== width || overlay.height !== height)
    Object.assign(overlay, { width, height });
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  if (isAll) context.clearRect(0, 0, innerWidth, innerHeight);
  const many = (scene.count ?? 0) > 400000;
  for (const pane of views.flatMap(panes)) {
    if (pane.area.width < 2 || pane.area.height < 2) continue;
    const scaled = Object.fromEntries(
      Object.entries(pane.area).map(([name, side]) => [name, Math.round(side * ratio)]),
    );
    const matrix = matrixOf(pane);
    if (pane.view === "range") scene.drawImage(pane.slot, scaled, camera.range);
    else {
      const near =
        pane.view === "plane"
          ? Math.min(Math.max(40 / camera.plane.metres, 0.7), 2)
          : Math.min(Math.max(30 / camera.space.distance, 0.8), 2);
      const sizes = (many ? [1, 1, 3] : [1.2 * near, 2 * near, 3.2 * near]).map((size) =>
        Math.max(1, size * ratio),
      );
      scene.drawPoints(pane.slot, scaled, matrix, sizes, true);
    }
    context.clearRect(pane.area.x, pane.area.y, pane.area.width, pane.area.height);
    drawOver(context, pane, matrix, document.activeElement === byId("range") ? state.cursor : null);
  }
  measured.draws += 1;
  measured.drawMs = performance.now() - began;
  if (!measured.firstPicture && picture()) measured.firstPicture = performance.now();
}

export const sceneOf = () => scene;

// How long the cloud takes to be drawn as it turns, until the graphics unit is done: the median.
export function measureDraw(times = 20) {
  const gl = scene.gl,
    pixel = new Uint8Array(4),
    took = [];
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
  const { width, height } = scene.canvas,
    whole = h("canvas", { width, height }),
    out = whole.getContext("2d");
  out.fillStyle = getComputedStyle(document.body).backgroundColor;
  out.fillRect(0, 0, width, height);
  out.drawImage(scene.canvas, 0, 0);
  out.drawImage(byId("overlay"), 0, 0);
  return new Promise((resolve) => whole.toBlob(resolve, "image/png"));
}

export function home() {
  if (state.points) camera.lookAtAll(state.points.position);
  due();
}

// Looks at what is selected.
export function showSelected() {
  const one = instanceOf(state.instance),
    at = state.selected.length ? position(state.selected[0]) : one?.centre;
  if (!at || !at.every(Number.isFinite)) return home();
  camera.lookAt(at, one ? Math.max(...one.size) : 4);
  const pixel = state.selected.length ? pixelOf(state.selected[0], state.slot) : null;
  if (pixel) {
    const { rows, columns, top_row_first: topFirst } = picture().run;
    Object.assign(camera.range, {
      x: pixel[1] / columns,
      y: (topFirst ? pixel[0] : rows - pixel[0]) / rows,
      zoom: 4,
    });
    camera.holdRange();
    state.cursor = pixel;
  }
  due();
}

// --- what stands beside them

function layers() {
  const group = byId("layers");
  if (!group.children.length) {
    group.append(
      ...LAYERS.map(([name, words], n) =>
        h(
          "button",
          {
            type: "button",
            role: "radio",
            "data-layer": name,
            onclick: () => setLayer(name),
            onkeydown: stepLayer,
          },
          h("kbd", {}, String(n + 1)),
          words,
        ),
      ),
    );
  }
  for (const button of group.children) {
    const { layer } = button.dataset,
      isOn = layer === state.layer;
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

const SHOWN = [
  ["boxes", "o"],
  ["ids", "i"],
  ["votes", "v"],
];
function toggles() {
  const group = document.querySelector(".toggles");
  if (!group.children.length) {
    group.append(
      ...SHOWN.map(([name, letter]) =>
        h("button", { type: "button", onclick: () => toggle(name) }, h("kbd", {}, letter), name),
      ),
    );
  }
  SHOWN.forEach(([name], n) =>
    group.children[n].setAttribute("aria-pressed", String(state.shown[name])),
  );
}

export function toggle(name) {
  state.shown[name] = !state.shown[name];
  tell("shown");
}

function legends() {
  const rows = legend().map(([colour, words, ...rest]) => {
    if (colour === "ramp") {
      const canvas = h("canvas", { width: 256, height: 1 }),
        out = canvas.getContext("2d");
      words.forEach((one, n) => {
        out.fillStyle = css(one);
        out.fillRect(Math.round(255 * (n / 255) ** 2), 0, 256, 1);
      });
      return h("li", {}, rest[0], canvas, rest[1]);
    }
    const sign = h("i");
    if (colour) sign.style.background = css(colour);
    return h("li", {}, colour ? sign : null, plain(words));
  });
  document.querySelector(".legend").replaceChildren(...rows);
}
