// A colour for each point in each layer: those of the figures.
//
// Four bytes a point: red, green, blue, and how large it is drawn: 0 not at all.

import { css, grouped } from "inspect/dom";
import { litPoints } from "inspect/nodes";
import { instanceOf, picture, state } from "inspect/state";

export const HIDDEN = 0,
  SMALL = 85,
  LARGE = 170,
  LIT = 255;

// Layers by name, in the order of their keys.
export const LAYERS = [
  ["range", "range"],
  ["intensity", "intensity"],
  ["classes", "classes"],
  ["mask", "mask"],
  ["components", "components"],
  ["instances", "instances"],
  ["reasons", "reasons"],
  ["truth", "truth"],
  ["difference", "A | B"],
];

export function isThere(layer) {
  switch (layer) {
    case "intensity":
      return Boolean(state.points?.intensity);
    case "classes":
      return Boolean(picture()?.run.has_classes);
    case "truth":
      return Boolean(state.points?.true_id);
    case "difference":
      return Boolean(state.compare && state.compared);
    default:
      return true;
  }
}

// Ranges of the points in metres, once a cloud.
let ranges = { of: null, values: null };
function rangeOf() {
  const { points } = state;
  if (ranges.of !== points) {
    const at = points.position,
      values = new Float32Array(at.length / 3);
    for (let n = 0; n < values.length; n++)
      values[n] = Math.hypot(at[3 * n], at[3 * n + 1], at[3 * n + 2]);
    ranges = { of: points, values };
  }
  return ranges.values;
}

// Colours of returns that are no objects: the nearer, the brighter.
function backdrop(range, [far, near]) {
  const NEAR = 4,
    FAR = 60;
  const part = Math.min(Math.max(Math.log(Math.max(range / NEAR, 1)) / Math.log(FAR / NEAR), 0), 1);
  return [0, 1, 2].map((n) => Math.round(near[n] + (far[n] - near[n]) * part));
}

let backdrops = null;
function backdropTable(tables) {
  backdrops ??= Array.from({ length: 256 }, (_, n) => backdrop(n / 4, tables.other_returns));
  return backdrops;
}

export const numbered = (tables, number) =>
  tables.instances[(number - 1) % tables.instances.length];
export const colourOf = (instance) => numbered(state.session.colours, instance.colour);

function differing(slot) {
  const side = slot === "B" ? "second" : "first";
  const all = new Map();
  for (const one of state.compared?.differences ?? [])
    for (const id of one[side]) all.set(id, one.change);
  return all;
}

const CHANGES = { split: "apart", joined: "merged", recut: "rejoined", reshaped: "object" };
export const changeColour = (change) => state.session.colours[CHANGES[change] ?? "focus"];

// A function from a point to its colour, null where it has none of its own.
function painter(layer, slot) {
  const {
      points,
      session: { colours: tables },
    } = state,
    { run, arrays } = state.pictures[slot];
  const palette = new Map(run.instances.map((one) => [one.id, numbered(tables, one.colour)]));
  const range = rangeOf();
  const ramp = (table, part) =>
    table[Math.min(Math.max(Math.round(Math.sqrt(Math.max(part, 0)) * 255), 0), 255)];
  switch (layer) {
    case "range":
      return (n) => ramp(tables.near_to_far, range[n] / run.far);
    case "intensity": {
      const high = state.cloud.intensity_high || 1;
      return (n) => ramp(tables.grey, (points.intensity?.[n] ?? 0) / high);
    }
    case "classes":
      return (n) =>
        arrays.is_object[n] ? (run.class_colours[arrays.class[n]] ?? tables.object) : null;
    case "mask":
      return (n) => (arrays.is_object[n] ? tables.object : null);
    case "components":
      return (n) => {
        const component = arrays.component[n];
        return component
          ? numbered(tables, component)
          : arrays.is_object[n]
            ? tables.reasons[5]
            : null;
      };
    case "reasons":
      return (n) => (arrays.instance[n] ? tables.object : tables.reasons[arrays.reason[n]]);
    case "truth":
      return (n) => {
        const colour = run.true_class_colours[points.true_class[n]];
        return colour ? numbered(tables, points.true_id[n]) : null;
      };
    case "difference": {
      const changed = differing(slot);
      return (n) => {
        const change = changed.get(arrays.instance[n]);
        return change ? changeColour(change) : null;
      };
    }
    default:
      return (n) => {
        const instance = arrays.instance[n];
        if (instance) return palette.get(instance);
        return arrays.is_object[n] ? tables.reasons[arrays.reason[n]] : null;
      };
  }
}

// The colours of all points in a slot, into an array that is used again.
export function paint(slot, into) {
  const {
      points,
      session: { colours: tables },
      instance: lit,
    } = state,
    { arrays } = state.pictures[slot];
  const count = points.position.length / 3;
  const out = into?.length === 4 * count ? into : new Uint8Array(4 * count);
  const own = painter(isThere(state.layer) ? state.layer : "instances", slot);
  const isRamp = state.layer === "range" || state.layer === "intensity";
  const range = rangeOf(),
    behind = backdropTable(tables),
    { instance } = arrays;
  const litId = slot === state.slot ? lit : litIn(slot),
    ofNode = slot === state.slot ? litPoints() : null;
  for (let n = 0, at = 0; n < count; n++, at += 4) {
    const isReturn = range[n] > 0 && range[n] < Infinity;
    if (!isReturn) {
      out[at + 3] = HIDDEN;
      continue;
    }
    let colour = own(n),
      size = LARGE;
    if (colour === null) {
      colour = behind[Math.min((range[n] * 4) | 0, 255)];
      size = SMALL;
    }
    if (isRamp) size = SMALL;
    if (ofNode ? ofNode[n] : litId && instance[n] === litId) {
      colour = tables.focus;
      size = LIT;
    }
    out[at] = colour[0];
    out[at + 1] = colour[1];
    out[at + 2] = colour[2];
    out[at + 3] = size;
  }
  return out;
}

// The instance of the other slot at the first point that is selected.
const litIn = (slot) =>
  state.selected.length ? state.pictures[slot].arrays.instance[state.selected[0]] : 0;

// What the colours of a layer mean: [colour, words], or ["ramp", table, low, high].
export function legend() {
  const tables = state.session.colours,
    now = picture();
  if (!now) return [];
  const { run, arrays } = now,
    other = [tables.other_returns[1], "other returns"];
  switch (isThere(state.layer) ? state.layer : "instances") {
    case "range":
      return [["ramp", tables.near_to_far, "0 m", `${run.far} m`]];
    case "intensity":
      return [
        ["ramp", tables.grey, "0", String(Number(state.cloud.intensity_high.toPrecision(3)))],
      ];
    case "classes": {
      const counts = new Map();
      for (let n = 0; n < arrays.class.length; n++)
        if (arrays.is_object[n])
          counts.set(arrays.class[n], (counts.get(arrays.class[n]) ?? 0) + 1);
      const most = [...counts].sort((a, b) => b[1] - a[1]).slice(0, 8);
      return [
        ...most.map(([id]) => [run.class_colours[id] ?? tables.object, run.classes[id]]),
        other,
      ];
    }
    case "mask":
      return [[tables.object, "object"], other];
    case "components":
      return [
        [null, `one colour per component (m = ${grouped(run.components)})`],
        [tables.reasons[5], "unreached"],
        other,
      ];
    case "reasons":
      return [
        [tables.object, "has an instance"],
        ...run.reasons
          .map((count, n) => [
            tables.reasons[n],
            `${tables.reason_words[n]} (${grouped(count)})`,
            count,
          ])
          .filter((row, n) => n > 0 && row[2]),
      ];
    case "truth":
      return [[null, "one colour per true object"], other];
    case "difference":
      return [...new Map(state.compared.counts)]
        .map(([change, count]) => [changeColour(change), `${change} (${count})`])
        .concat([other]);
    default:
      return [
        [null, `one colour per instance (n = ${grouped(run.instances.length)})`],
        ...[6, 5, 8]
          .filter((n) => run.reasons[n])
          .map((n) => [tables.reasons[n], tables.reason_words[n]]),
        other,
      ];
  }
}

export const swatch = (id) => {
  const one = instanceOf(id);
  return one ? css(colourOf(one)) : "transparent";
};
