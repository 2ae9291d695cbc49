// What lies above the points: boxes and votes as lines in space, and on a canvas over all views ids,
// selected points, the pairs of pixels of an explanation, scale bars.

import { changeColour, colourOf } from "inspect/colours";
import { css } from "inspect/dom";
import { plane, project, range } from "inspect/camera";
import { drawnNodes, drawOutlines, nodeColour, outlineOf } from "inspect/nodes";
import { position, state } from "inspect/state";

const EDGES = [
  [0, 1],
  [1, 3],
  [3, 2],
  [2, 0],
  [4, 5],
  [5, 7],
  [7, 6],
  [6, 4],
  [0, 4],
  [1, 5],
  [2, 6],
  [3, 7],
];

function corners({ centre, size, yaw }) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  return Array.from({ length: 8 }, (_, n) => {
    const [x, y, z] = [n & 1, (n >> 1) & 1, n >> 2].map((side, axis) => (side - 0.5) * size[axis]);
    return [centre[0] + c * x - s * y, centre[1] + s * x + c * y, centre[2] + z];
  });
}

export function differingIds(slot) {
  const side = slot === "B" ? "second" : "first";
  return new Map(
    (state.compared?.differences ?? []).flatMap((one) => one[side].map((id) => [id, one.change])),
  );
}

// Boxes and votes of a slot as lines: their ends, and their colours.
export function lines(slot) {
  const { run, arrays } = state.pictures[slot],
    ends = [],
    colours = [];
  const add = (a, b, colour) => {
    ends.push(...a, ...b);
    for (let n = 0; n < 2; n++) colours.push(...colour, 255);
  };
  const { colours: tables } = state.session;
  const changed = state.compare && state.compared ? differingIds(slot) : new Map();
  if (state.shown.boxes) {
    for (const one of run.instances) {
      const change = changed.get(one.id);
      if (!one.is_object && one.id !== state.instance && !change) continue;
      const at = corners(one),
        isLit = one.id === state.instance && slot === state.slot;
      const colour = isLit ? tables.focus : change ? changeColour(change) : colourOf(one);
      for (const [a, b] of EDGES) add(at[a], at[b], colour);
      if (change) {
        const wide = corners({ ...one, size: one.size.map((side) => side + 0.3) });
        for (const [a, b] of EDGES) add(wide[a], wide[b], colour);
      }
    }
  }
  if (slot === state.slot) {
    for (const { node, isLit } of drawnNodes()) {
      if (!node.bounds) continue;
      const colour = isLit ? [255, 255, 255] : nodeColour(node);
      const sizes = node.is_chosen || isLit ? [0, 0.06, 0.12] : [0];
      for (const more of sizes) {
        const at = corners({ ...node.bounds, size: node.bounds.size.map((side) => side + more) });
        for (const [a, b] of EDGES) add(at[a], at[b], colour);
      }
    }
  }
  if (state.shown.votes) {
    const edge = arrays.edge_ends;
    arrays.edge_decision.forEach((decision, n) => {
      const at = [...edge.slice(6 * n, 6 * n + 6)];
      add(at.slice(0, 3), at.slice(3), tables[run.decisions[decision]]);
    });
  }
  return [new Float32Array(ends), new Uint8Array(colours)];
}

// Where a pixel of the range image is in an area.
export function atPixel({ rows, columns, top_row_first: topFirst }, area, row, column) {
  const [u, v] = [(column + 0.5) / columns, ((topFirst ? row : rows - 1 - row) + 0.5) / rows];
  return [
    area.x + ((u - range.x) * range.zoom + 0.5) * area.width,
    area.y + ((v - range.y) * range.zoom + 0.5) * area.height,
  ];
}

export function pixelOf(point, slot) {
  const { run, arrays } = state.pictures[slot],
    pixel = arrays.pixel_of_point[point];
  return pixel === undefined || pixel === 0xffffffff
    ? null
    : [Math.floor(pixel / run.columns), pixel % run.columns];
}

// The place of something in a pane, in pixels of the page; null if it is not in sight.
export function placeIn(pane, matrix, at, pixel) {
  const { area } = pane;
  let place;
  if (pane.view === "range")
    place = pixel && atPixel(state.pictures[pane.slot].run, area, ...pixel);
  else if (at.every(Number.isFinite)) {
    const [x, y, w] = project(matrix, at);
    place = w > 0 && [area.x + ((x + 1) / 2) * area.width, area.y + ((1 - y) / 2) * area.height];
  }
  const isIn =
    place &&
    place[0] >= area.x &&
    place[0] <= area.x + area.width &&
    place[1] >= area.y &&
    place[1] <= area.y + area.height;
  return isIn ? place : null;
}

// The pairs of pixels that voted, and the links of the chain of merges, as lines.
export function explainedLines() {
  const votes = state.explanation?.report.votes,
    out = [];
  if (!votes) return out;
  const { colours: tables } = state.session;
  const links = votes.links ?? [];
  const pairs = [...(votes.border ?? []), ...links.flatMap((link) => link.pairs)];
  for (const pair of pairs.slice(0, 400)) {
    out.push({
      a: pair.a.position,
      b: pair.b.position,
      pixels: [pair.a, pair.b].map((one) => [one.row, one.column]),
      colour: tables[pair.holds ? "merged" : "apart"],
      width: 2,
      pair,
    });
  }
  for (const link of links) {
    const [a, b] = [link.target, link.query].map(centreOf);
    if (a && b)
      out.push({
        a: a.at,
        b: b.at,
        pixels: [a.pixel, b.pixel],
        colour: tables.focus,
        width: 1.5,
        dash: [5, 4],
        link,
      });
  }
  return out;
}

// The point of a component that is nearest to its middle.
let centres = { of: null, map: new Map() };
function centreOf(label) {
  const now = state.pictures[state.slot],
    { component, pixel_of_point: pixels } = now.arrays;
  if (centres.of !== now) centres = { of: now, map: new Map() };
  if (!centres.map.has(label)) {
    const points = [],
      sum = [0, 0, 0];
    component.forEach((own, n) => {
      if (own === label) {
        points.push(n);
        position(n).forEach((x, axis) => {
          sum[axis] += x;
        });
      }
    });
    const middle = sum.map((x) => x / points.length);
    const away = (n) => Math.hypot(...position(n).map((x, axis) => x - middle[axis]));
    const nearest = points.reduce(
      (best, n) => (best === null || away(n) < away(best) ? n : best),
      null,
    );
    const pixel = nearest === null ? null : pixels[nearest];
    centres.map.set(
      label,
      nearest === null
        ? null
        : {
            at: position(nearest),
            pixel: [Math.floor(pixel / now.run.columns), pixel % now.run.columns],
          },
    );
  }
  return centres.map.get(label);
}

// The middle pixel of each instance.
const middles = new WeakMap();
function middlePixels(slot) {
  const now = state.pictures[slot];
  if (middles.has(now)) return middles.get(now);
  const { point_of_pixel: points, instance } = now.arrays,
    { columns } = now.run,
    all = new Map();
  points.forEach((point, pixel) => {
    const id = point === 0xffffffff ? 0 : instance[point];
    if (id) {
      if (!all.has(id)) all.set(id, []);
      all.get(id).push(pixel);
    }
  });
  const map = new Map(
    [...all].map(([id, pixels]) => {
      const byColumn = pixels.sort((a, b) => (a % columns) - (b % columns)),
        pixel = byColumn[byColumn.length >> 1];
      return [id, [Math.floor(pixel / columns), pixel % columns]];
    }),
  );
  middles.set(now, map);
  return map;
}

function text(context, words, [x, y], colour, size = 11, weight = 500) {
  context.font = `${weight} ${size}px system-ui, "DejaVu Sans", sans-serif`;
  context.textAlign = "center";
  context.lineWidth = 3;
  context.strokeStyle = css(state.session.colours.panel, 0.85);
  context.strokeText(words, x, y);
  context.fillStyle = colour;
  context.fillText(words, x, y);
}

function ids(context, pane, matrix) {
  const { run } = state.pictures[pane.slot];
  const room = pane.view === "space" ? 60 : 80,
    shown = [];
  const middle = pane.view === "range" ? middlePixels(pane.slot) : null;
  const order = run.instances
    .filter((one) => one.is_object || one.id === state.instance)
    .sort((a, b) => b.points - a.points);
  for (const one of order) {
    if (shown.length >= room) break;
    const [x, y, z] = one.centre,
      place = placeIn(pane, matrix, [x, y, z + one.size[2] / 2], middle?.get(one.id));
    if (
      !place ||
      shown.some(([a, b]) => Math.abs(a - place[0]) < 26 && Math.abs(b - place[1]) < 12)
    )
      continue;
    shown.push(place);
    const isLit = one.id === state.instance && pane.slot === state.slot;
    text(
      context,
      String(one.id),
      [place[0], place[1] - 3],
      isLit ? css(state.session.colours.focus) : "#e8eaee",
      isLit ? 13 : 11,
    );
  }
}

function marks(context, pane, matrix) {
  const focus = css(state.session.colours.focus),
    names = state.selected.length === 1 ? [""] : ["A", "B"];
  state.selected.forEach((point, n) => {
    const place = placeIn(pane, matrix, position(point), pixelOf(point, pane.slot));
    if (!place) return;
    for (const [colour, width] of [
      ["#13151a", 4.5],
      [focus, 2],
    ]) {
      context.beginPath();
      context.arc(...place, 6.5, 0, 2 * Math.PI);
      Object.assign(context, { strokeStyle: colour, lineWidth: width });
      context.stroke();
    }
    if (names[n]) text(context, names[n], [place[0] + 14, place[1] - 5], focus, 14, 600);
  });
}

// The order in which nodes joined, at their upper corners.
function orders(context, pane, matrix) {
  const shown = [];
  const all = drawnNodes().sort(
    (a, b) => b.isLit - a.isLit || b.node.is_chosen - a.node.is_chosen || b.node.order - a.node.order,
  );
  for (const { node, place: number, isLit } of all) {
    let place = null;
    if (pane.view === "range") {
      const [x, y] = outlineOf(number).corner ?? [],
        { rows, columns } = state.pictures[pane.slot].run,
        { area } = pane;
      place = [
        area.x + ((x / columns - range.x) * range.zoom + 0.5) * area.width - 14,
        area.y + ((y / rows - range.y) * range.zoom + 0.5) * area.height,
      ];
    } else if (node.bounds) {
      const top = corners(node.bounds).slice(4),
        seen = top.map((at) => placeIn(pane, matrix, at)).filter(Boolean);
      place = seen.sort((a, b) => b[0] - b[1] - (a[0] - a[1]))[0];
    }
    const isFree = ([x, y]) =>
      shown.every(([a, b]) => Math.abs(a - x) > 18 || Math.abs(b - y) > 13);
    if (!place || !isFree(place)) continue;
    shown.push(place);
    const colour = css(isLit ? [255, 255, 255] : nodeColour(node));
    text(context, String(node.order), [place[0] + 8, place[1] - 3], colour, 12, 700);
  }
}

function scaleBar(context, { area }) {
  const metres = plane.metres / area.width,
    most = (area.width / 4) * metres;
  const power = 10 ** Math.floor(Math.log10(most)),
    length = [5, 2, 1].map((n) => n * power).find((n) => n <= most);
  const [x, y, wide] = [area.x + 12, area.y + area.height - 14, length / metres];
  Object.assign(context, { strokeStyle: "#e8eaee", lineWidth: 1.5 });
  context.beginPath();
  for (const [px, py] of [
    [x, y - 4],
    [x, y],
    [x + wide, y],
    [x + wide, y - 4],
  ])
    context.lineTo(px, py);
  context.stroke();
  text(context, `${length} m`, [x + wide / 2, y - 6], "#e8eaee");
}

// Draws all that lies above a pane.
export function drawOver(context, pane, matrix, cursor) {
  const { area } = pane;
  context.save();
  context.beginPath();
  context.rect(area.x, area.y, area.width, area.height);
  context.clip();
  if (state.pictures[pane.slot]) {
    for (const line of explainedLines()) {
      const [a, b] = [line.a, line.b].map((at, n) =>
        placeIn(
          pane,
          matrix,
          at.map((x) => x ?? NaN),
          line.pixels[n],
        ),
      );
      if (!a || !b || Math.abs(a[0] - b[0]) > area.width * 0.7) continue;
      for (const [colour, width] of [
        ["#13151a", line.width + 2],
        [css(line.colour), line.width],
      ]) {
        Object.assign(context, { strokeStyle: colour, lineWidth: width });
        context.setLineDash(line.dash ?? []);
        context.beginPath();
        context.moveTo(...a);
        context.lineTo(...b);
        context.stroke();
      }
      context.setLineDash([]);
    }
    if (pane.slot === state.slot) {
      if (pane.view === "range") drawOutlines(context, area, range);
      orders(context, pane, matrix);
    }
    if (state.shown.ids && !drawnNodes().length) ids(context, pane, matrix);
    marks(context, pane, matrix);
    if (pane.view === "plane") scaleBar(context, pane);
    if (cursor && pane.view === "range") {
      const [x, y] = atPixel(state.pictures[pane.slot].run, area, ...cursor);
      Object.assign(context, { strokeStyle: "#ffffff", lineWidth: 1 });
      context.strokeRect(x - 4.5, y - 4.5, 9, 9);
    }
  }
  if (state.compare && state.pictures.B)
    text(
      context,
      pane.slot,
      [area.x + area.width - 14, area.y + area.height - 10],
      "#e8eaee",
      15,
      700,
    );
  context.restore();
}
