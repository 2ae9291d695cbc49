// What mouse and keys do in the views: they turn, move, enlarge, and select.

import * as camera from "inspect/camera";
import { byId, fixed, say } from "inspect/dom";
import { pixelOf } from "inspect/overlay";
import { instanceOf, picture, position, select, state, tell } from "inspect/state";
import { VIEWS, due, home, matrixOf, painted, panes } from "inspect/views";

export function start() {
  VIEWS.forEach(listen);
}

function paneAt(view, x, y) {
  return (
    panes(view).find(
      ({ area }) =>
        x >= area.x && x < area.x + area.width && y >= area.y && y < area.y + area.height,
    ) ?? panes(view)[0]
  );
}

function pixelAt({ area, slot }, x, y) {
  const { rows, columns, top_row_first: topFirst } = state.pictures[slot].run,
    { range } = camera;
  const u = ((x - area.x) / area.width - 0.5) / range.zoom + range.x,
    v = ((y - area.y) / area.height - 0.5) / range.zoom + range.y;
  const [row, column] = [Math.floor(v * rows), Math.floor(u * columns)];
  return [topFirst ? row : rows - 1 - row, column].map((n, axis) =>
    Math.min(Math.max(n, 0), (axis ? columns : rows) - 1),
  );
}

// The point in a pixel, or in the nearest one that has some, as far as a finger is wide.
function pointInPixel(slot, [row, column], reach = 3) {
  const { run, arrays } = state.pictures[slot];
  let best = null;
  for (let r = row - reach; r <= row + reach; r++)
    for (let c = column - reach; c <= column + reach; c++) {
      if (r < 0 || c < 0 || r >= run.rows || c >= run.columns) continue;
      const point = arrays.point_of_pixel[r * run.columns + c],
        away = Math.hypot(r - row, c - column);
      if (point !== 0xffffffff && (best === null || away < best.away)) best = { point, away };
    }
  return best?.point ?? null;
}

// The point that is drawn nearest to a place: of two the one in front.
export function pick(view, x, y) {
  if (!picture()) return null;
  const pane = paneAt(view, x, y);
  if (view === "range") return pointInPixel(pane.slot, pixelAt(pane, x, y));
  const { area, slot } = pane,
    m = matrixOf(pane),
    at = state.points.position,
    colours = painted[slot];
  const REACH = 9;
  const [tx, ty] = [((x - area.x) / area.width) * 2 - 1, 1 - ((y - area.y) / area.height) * 2];
  const [rx, ry] = [(2 * REACH) / area.width, (2 * REACH) / area.height];
  let best = null,
    least = Infinity;
  for (let n = 0, k = 0; k < at.length; n++, k += 3) {
    if (!colours[4 * n + 3]) continue;
    const X = at[k],
      Y = at[k + 1],
      Z = at[k + 2],
      w = m[3] * X + m[7] * Y + m[11] * Z + m[15];
    if (w <= 0) continue;
    const dx = ((m[0] * X + m[4] * Y + m[8] * Z + m[12]) / w - tx) / rx,
      dy = ((m[1] * X + m[5] * Y + m[9] * Z + m[13]) / w - ty) / ry;
    const away = dx * dx + dy * dy;
    if (away > 1) continue;
    const depth = (m[2] * X + m[6] * Y + m[10] * Z + m[14]) / w,
      cost = away + (view === "space" ? 60 * (depth + 1) : depth + 1);
    if (cost < least) {
      least = cost;
      best = n;
    }
  }
  return best;
}

function describe(point, slot) {
  const { arrays } = state.pictures[slot],
    id = arrays.instance[point],
    [x, y, z] = position(point);
  const what = id
    ? (instanceOf(id, slot)?.title ?? id)
    : state.session.colours.reason_words[arrays.reason[point]];
  return `${what}  ·  ${fixed(x, 2)}, ${fixed(y, 2)}, ${fixed(z, 2)} m  ·  point ${point}`;
}

function move(view, dx, dy, isShift) {
  const { area } = panes(view)[0],
    { plane, range } = camera;
  if (view === "space") isShift ? camera.shift(dx, dy, area.height) : camera.turn(dx, dy);
  else if (view === "plane") {
    plane.x -= (dx / area.width) * plane.metres;
    plane.y += (dy / area.width) * plane.metres;
  } else {
    range.x -= dx / area.width / range.zoom;
    range.y -= dy / area.height / range.zoom;
    camera.holdRange();
  }
  due(view);
}

function zoom(view, factor, x, y) {
  const pane = x === undefined ? panes(view)[0] : paneAt(view, x, y),
    { area } = pane;
  const [u, v] =
    x === undefined ? [0.5, 0.5] : [(x - area.x) / area.width, (y - area.y) / area.height];
  const { plane, range } = camera;
  if (view === "space") camera.zoomSpace(factor);
  else if (view === "plane")
    camera.zoomPlane(factor, [
      plane.x + (u - 0.5) * plane.metres,
      plane.y - ((v - 0.5) * plane.metres * area.height) / area.width,
    ]);
  else
    camera.zoomRange(1 / factor, [
      range.x + (u - 0.5) / range.zoom,
      range.y + (v - 0.5) / range.zoom,
    ]);
  due(view);
}

function listen(view) {
  const element = byId(view);
  let held = null;
  const isView = (event) => !event.target.closest("button");
  element.addEventListener("pointerdown", (event) => {
    if (!isView(event)) return;
    element.setPointerCapture(event.pointerId);
    held = {
      x: event.clientX,
      y: event.clientY,
      moved: 0,
      shift: event.shiftKey || event.button > 0,
    };
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
    if (held && held.moved <= 4 && event.button === 0)
      choose(view, event.clientX, event.clientY, event.shiftKey || state.selected.length === 1);
    held = null;
  });
  element.addEventListener("pointercancel", () => {
    held = null;
  });
  element.addEventListener("contextmenu", (event) => event.preventDefault());
  element.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      zoom(
        view,
        Math.exp(Math.max(-1, Math.min(1, event.deltaY / 240)) * 0.5),
        event.clientX,
        event.clientY,
      );
    },
    { passive: false },
  );
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
  if (state.compare && pane.slot !== state.slot) {
    state.slot = pane.slot;
    tell("slot");
  }
  select(point, isSecond);
  say(describe(point, pane.slot));
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

function key(view, event) {
  if (event.ctrlKey || event.metaKey || event.altKey || event.target !== event.currentTarget)
    return;
  const arrow = ARROWS[event.key];
  if (arrow && view === "range") moveCursor(arrow, event.shiftKey ? 10 : 1);
  else if (arrow) move(view, -arrow[0] * 40, -arrow[1] * 40, event.shiftKey);
  else if (event.key === "+" || event.key === "=") zoom(view, 0.8);
  else if (event.key === "-") zoom(view, 1.25);
  else if (event.key === "0") home();
  else if (event.key === "Enter" && view === "range" && state.cursor) {
    const point = pointInPixel(state.slot, state.cursor);
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
  state.cursor ??= (state.selected.length && pixelOf(state.selected[0], state.slot)) || [
    rows >> 1,
    columns >> 1,
  ];
  const row = Math.min(Math.max(state.cursor[0] + (topFirst ? dy : -dy) * by, 0), rows - 1);
  state.cursor = [row, (state.cursor[1] + dx * by + columns) % columns];
  const point = pointInPixel(state.slot, state.cursor);
  say(
    point === null
      ? `row ${state.cursor[0]}, column ${state.cursor[1]}: nothing there`
      : describe(point, state.slot),
  );
  due("range");
}
