// What is shown. A change is told to all who listen for it by name.

const listeners = new Map();

export const state = {
  session: null,
  topic: "",
  frame: 0,
  settings: { A: emptySetting(), B: emptySetting() },
  // The slot that the panel changes; both are shown if `compare` is on.
  slot: "A",
  compare: false,
  // The points of the cloud, and what a run found, of each slot.
  cloud: null,
  points: null,
  pictures: { A: null, B: null },
  scores: { A: null, B: null },
  compared: null,
  layer: "instances",
  shown: { boxes: true, ids: true, votes: false },
  // Points that are selected, at most two, and the instance that is lit up.
  selected: [],
  instance: 0,
  // Row and column of the cursor in the range image.
  cursor: null,
  explanation: null,
  // The node of the explanation that is lit up, by its place in the list.
  node: null,
  // The worst of many frames, and the object over time of each instance of this one.
  survey: null,
  tracks: null,
};

export function emptySetting() {
  return { preset: null, method: null, set: {} };
}

export function on(names, call) {
  for (const name of names.split(" ")) {
    if (!listeners.has(name)) listeners.set(name, []);
    listeners.get(name).push(call);
  }
}

export function tell(name, detail) {
  for (const call of listeners.get(name) ?? []) call(detail);
}

export const picture = (slot = state.slot) => state.pictures[slot];
export const slots = () => (state.compare && state.pictures.B ? ["A", "B"] : [state.slot]);
export const asked = (slot = state.slot) => ({
  topic: state.topic,
  frame: state.frame,
  setting: state.settings[slot],
});
export const instanceOf = (id, slot = state.slot) =>
  picture(slot)?.run.instances.find((one) => one.id === id);

export function position(point) {
  const at = state.points?.position;
  return at && point * 3 + 2 < at.length
    ? [at[3 * point], at[3 * point + 1], at[3 * point + 2]]
    : [NaN, NaN, NaN];
}

// Selects a point; a second one beside the first if `more`.
export function select(point, more = false) {
  const before = state.selected;
  state.selected = more && before.length > 0 && before[0] !== point ? [before[0], point] : [point];
  state.instance = picture()?.arrays.instance[point] ?? 0;
  state.explanation = null;
  tell("selection");
}

export function selectPoints(points, instance) {
  state.selected = points.slice(0, 2);
  state.instance = instance ?? picture()?.arrays.instance[points[0]] ?? 0;
  state.explanation = null;
  tell("selection");
}

export function clearSelection() {
  state.selected = [];
  state.instance = 0;
  state.explanation = null;
  tell("selection");
}
