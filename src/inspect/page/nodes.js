// Without classes: the nodes of the tree of merges between two points and where they join. In space
// and from above they are boxes, in the range image outlines, in the text rows; one lights up its
// points.

import { css, fixed, grouped, h, plain } from "inspect/dom";
import { picture, state, tell } from "inspect/state";

// The node that stays lit, by its place in the list.
let pinned = null;

export const nodes = () => state.explanation?.nodes ?? [];

// Pixels of a node, those of its parts too.
const pixelsOfNode = new WeakMap();
function pixelsOf(place) {
  const node = nodes()[place];
  if (!pixelsOfNode.has(node)) {
    const all = node.parts.flatMap(pixelsOf);
    for (let n = 0; n < node.runs.length; n += 2)
      for (let k = 0; k < node.runs[n + 1]; k++) all.push(node.runs[n] + k);
    pixelsOfNode.set(node, all);
  }
  return pixelsOfNode.get(node);
}

// The points of the node that is lit, as flags of all points; null if none is.
export function litPoints() {
  if (state.node === null || !nodes()[state.node]) return null;
  const { arrays } = picture(),
    flags = new Uint8Array(arrays.instance.length);
  for (const pixel of pixelsOf(state.node)) {
    const point = arrays.point_of_pixel[pixel];
    if (point !== 0xffffffff) flags[point] = 1;
  }
  return flags;
}

// The colour of a node: of those that hold both points by the answer.
export function nodeColour(node) {
  const { colours: tables } = state.session;
  if (node.is_chosen) return tables.focus;
  if (node.holds.length < 2) return tables.node;
  const isOne = state.explanation.report.answer === "one_instance";
  return tables[isOne ? "merged" : "apart"];
}

// The nodes that are drawn: those on the way, and the one that is lit.
export const drawnNodes = () =>
  nodes()
    .map((node, place) => ({ node, place, isLit: place === state.node }))
    .filter(({ node, isLit }) => node.is_on_the_way || isLit);

// Outlines of the pixels of a node, in columns and in rows from the top.
const outlines = new WeakMap();
export function outlineOf(place) {
  const node = nodes()[place];
  if (outlines.has(node)) return outlines.get(node);
  const { rows, columns, top_row_first: topFirst } = picture().run,
    own = new Set(pixelsOf(place)),
    path = new Path2D();
  let corner = null;
  for (const pixel of own) {
    const row = Math.floor(pixel / columns),
      x = pixel % columns,
      y = topFirst ? row : rows - 1 - row;
    const up = topFirst ? -columns : columns;
    // Gaps of one or two pixels within a node have no outline.
    const line = (step, room, from, to) => {
      for (let n = 1; n <= Math.min(3, room); n++) if (own.has(pixel + n * step)) return;
      path.moveTo(...from);
      path.lineTo(...to);
    };
    line(up, 3, [x, y], [x + 1, y]);
    line(-up, 3, [x, y + 1], [x + 1, y + 1]);
    line(-1, x, [x, y], [x, y + 1]);
    line(1, columns - 1 - x, [x + 1, y], [x + 1, y + 1]);
    if (!corner || y < corner[1] || (y === corner[1] && x < corner[0])) corner = [x, y];
  }
  outlines.set(node, { path, corner });
  return outlines.get(node);
}

// Draws outlines over the range image, which is moved and enlarged by a matrix.
export function drawOutlines(context, area, { x, y, zoom }) {
  const { rows, columns } = picture().run,
    across = (area.width * zoom) / columns,
    down = (area.height * zoom) / rows;
  const matrix = new DOMMatrix([
    across,
    0,
    0,
    down,
    area.x + area.width * (0.5 - x * zoom),
    area.y + area.height * (0.5 - y * zoom),
  ]);
  for (const { node, place, isLit } of drawnNodes()) {
    const moved = new Path2D();
    moved.addPath(outlineOf(place).path, matrix);
    const width = isLit ? 3 : node.is_chosen ? 2.5 : 1.25;
    Object.assign(context, { strokeStyle: "#13151a", lineWidth: width + 1.5, lineCap: "square" });
    context.stroke(moved);
    Object.assign(context, { strokeStyle: css(isLit ? [255, 255, 255] : nodeColour(node)) });
    context.lineWidth = width;
    context.stroke(moved);
  }
}

// Lights up a node, or none.
function light(place) {
  if (state.node === place) return;
  state.node = place;
  tell("node");
}

// Forgets which node is lit.
export function forgetNode() {
  pinned = null;
  state.node = null;
}

function pin(place) {
  pinned = pinned === place ? null : place;
  light(pinned);
  for (const one of document.querySelectorAll("[data-node]"))
    one.setAttribute("aria-pressed", String(Number(one.dataset.node) === pinned));
}

// A button of a node: its points light up while it is pointed at or has the focus, and stay lit
// when it is pressed.
function nodeButton(place, words) {
  return h(
    "button",
    {
      type: "button",
      className: "node",
      "data-node": place,
      "aria-pressed": String(pinned === place),
      title: "its points light up",
      onmouseenter: () => light(place),
      onmouseleave: () => light(pinned),
      onfocus: () => light(place),
      onblur: () => light(pinned),
      onclick: () => pin(place),
    },
    words,
  );
}

const NAMES = ["A", "B"];

// The nodes as rows in the order in which they came to be.
export function nodeTable() {
  const all = nodes();
  if (!all.length) return null;
  const isPair = state.selected.length === 2;
  const row = ({ node, place }) => {
    const sign = h("i", { className: "node-sign" });
    sign.style.borderColor = css(nodeColour(node));
    const held = node.holds.length > 1 ? "both" : NAMES[node.holds[0]];
    const looks = node.score === null ? "–" : `${node.body} ${fixed(node.score, 2)}`;
    return h(
      "tr",
      { className: node.is_on_the_way ? "" : "faint" },
      h("td", { className: "number" }, String(node.order)),
      h("td", {}, sign, nodeButton(place, String(node.node))),
      isPair ? h("td", {}, held) : null,
      h("td", { className: "number" }, fixed(node.gaps[0], 2)),
      h("td", { className: "number" }, grouped(node.pixels)),
      h("td", {}, looks, node.is_chosen ? h("b", {}, " chosen") : null),
    );
  };
  const head = ["joins", "node", ...(isPair ? ["holds"] : []), "from, m", "pixels", "looks like"];
  const rows = all
    .map((node, place) => ({ node, place }))
    .sort((a, b) => a.node.order - b.node.order);
  return h(
    "div",
    {},
    h("h3", {}, isPair ? "Chain of merges, to where they join" : "Chain of merges"),
    h(
      "table",
      { id: "nodes" },
      h("thead", {}, h("tr", {}, head.map((name) => h("th", { scope: "col" }, name)))),
      h("tbody", {}, rows.map(row)),
    ),
    isPair && all.every((node) => node.holds.length < 2)
      ? h("p", { className: "faint" }, "They join in no node.")
      : null,
  );
}

// Words in which each node that is known is a button.
export function withNodes(words) {
  const places = new Map(nodes().map((node, place) => [String(node.node), place]));
  return plain(words)
    .split(/(\bnode \d+)/)
    .map((part) => {
      const place = places.get(part.match(/^node (\d+)$/)?.[1]);
      return place === undefined ? part : nodeButton(place, part);
    });
}
