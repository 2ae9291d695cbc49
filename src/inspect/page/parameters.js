// What if: parameters of two settings, A and B. A change clusters the frame again.

import { afterPause, byId, fixed, h, latest, plain, say } from "inspect/dom";
import { figures } from "inspect/figures";
import { source } from "inspect/source";
import { asked, emptySetting, on, picture, state, tell } from "inspect/state";

// Milliseconds from the last change of a parameter to the picture it made, for people and tests.
export const latency = { ms: null };
// Milliseconds that a slider rests before the lists follow.
const PAUSE = 150;
// The parameters without effect when the rows were made.
let idleWhenBuilt;

export function start() {
  build();
  on("slot setting frame", build);
  on("settled compare", figures);
}

const setting = () => state.settings[state.slot];
const isChanged = (path) => path in setting().set;
// The value in the run that is shown; null of a part that is off.
const valueOf = (path) => picture()?.run.values[path] ?? null;
const all = () => [...state.session.parameters, ...(picture()?.run.method_parameters ?? [])];

function build() {
  const { session } = state,
    panel = byId("parameters"),
    kept = panel.scrollTop,
    focused = document.activeElement?.dataset?.path;
  const filter = panel.querySelector("input[type=search]")?.value ?? "";
  panel.replaceChildren(
    h(
      "div",
      { className: "sticky" },
      slotRow(),
      presetRow(session),
      h("input", {
        type: "search",
        placeholder: "find a parameter",
        "aria-label": "find a parameter",
        value: filter,
        oninput: (event) => narrow(event.target.value),
      }),
    ),
    h("div", { id: "figures" }),
    h("div", { id: "all-parameters" }, ...groups()),
  );
  narrow(filter);
  figures();
  idleWhenBuilt = idle();
  panel.scrollTop = kept;
  if (focused) panel.querySelector(`[data-path="${CSS.escape(focused)}"]`)?.focus();
}

function slotRow() {
  const slot = (name) =>
    h(
      "button",
      {
        type: "button",
        role: "radio",
        "aria-checked": String(state.slot === name),
        title: `change setting ${name} (${name.toLowerCase()})`,
        onclick: () => chooseSlot(name),
      },
      name,
    );
  return h(
    "div",
    { className: "row" },
    h(
      "span",
      { role: "radiogroup", "aria-label": "setting that is changed", className: "row" },
      slot("A"),
      slot("B"),
    ),
    h(
      "button",
      {
        type: "button",
        id: "compare",
        "aria-pressed": String(state.compare),
        title: "both side by side (c)",
        onclick: toggleCompare,
      },
      "A | B",
    ),
    h(
      "button",
      { type: "button", disabled: isPlain(), onclick: () => change(emptySetting()) },
      "Reset all",
    ),
  );
}

const isPlain = () =>
  !setting().preset && !setting().method && Object.keys(setting().set).length === 0;

function presetRow({ presets, preset, methods, method }) {
  const choice = (label, names, usual, name) => {
    const now = setting()[name] ?? usual;
    return h(
      "label",
      { className: "field" },
      label,
      h(
        "select",
        {
          "data-path": name,
          onchange: (event) =>
            change({
              ...setting(),
              [name]: event.target.value === usual ? null : event.target.value,
            }),
        },
        names.map((one) =>
          h(
            "option",
            { value: one, selected: one === now },
            one === usual ? `${one} (as started)` : one,
          ),
        ),
      ),
    );
  };
  return h(
    "div",
    { className: "row" },
    choice("preset", presets, preset, "preset"),
    choice("method", methods, method, "method"),
  );
}

function groups() {
  const byGroup = new Map();
  for (const one of all()) {
    if (valueOf(one.path) === null && one.kind !== "switch") continue;
    const parts = one.path.split("."),
      group = one.kind === "switch" ? one.path : parts.slice(0, -1).join(".") || parts[0];
    if (!byGroup.has(group)) byGroup.set(group, []);
    byGroup.get(group).push(one);
  }
  // What the clustering goes by comes first; what seldom helps is folded.
  const place = (group) =>
    [
      "cluster",
      "method",
      "smoothing",
      "bleed",
      "segment_vote",
      "vehicle_strips",
      "ground",
      "projection",
    ].indexOf(group.split(".")[0]);
  const sorted = [...byGroup].sort(([a], [b]) => place(a) - place(b));
  const isOpen = (group) => folded.get(group) ?? /^(cluster|method)/.test(group);
  return [...sorted.map(groupOf), overTime(state.session.parameters_over_time)];
  function groupOf([group, own]) {
    const reasons = new Set(own.map(whyIdle)),
      isIdle = !reasons.has(undefined);
    return h(
      "details",
      {
        className: "group",
        open: isOpen(group) && !(isIdle && !folded.has(group)),
      },
      h(
        "summary",
        { onclick: (event) => folded.set(group, !event.currentTarget.parentElement.open) },
        group,
        isIdle ? h("span", { className: "faint" }, " no effect here") : null,
      ),
      [...reasons]
        .filter(Boolean)
        .map((words) => h("p", { className: "faint idle" }, `No effect: ${words}.`)),
      own.filter((one) => !whyIdle(one)).map(row),
    );
  }
}

// Why a parameter changes nothing of what is shown; nothing of one that does.
const whyIdle = ({ path }) => picture()?.run.idle[path];

// What acts over many frames has no slider here, and says so.
function overTime(parts) {
  const words = parts.map(([part, count]) => `${part} (${count})`).join(", ");
  return h(
    "p",
    { className: "faint", id: "over-time" },
    `Without effect on one frame, and so not here: ${words}. Set them with --set; divmerge params lists them.`,
  );
}

const folded = new Map();
const isDegrees = ({ unit }) => unit === "rad";
const DEGREE = 180 / Math.PI;
// A number as it is shown: angles in degrees.
const toShown = (parameter, value) => (isDegrees(parameter) ? value * DEGREE : value);
const fromShown = (parameter, number) => (isDegrees(parameter) ? `${number} deg` : number);
const unitOf = (parameter) => (isDegrees(parameter) ? "°" : (parameter.unit ?? ""));

function row(parameter) {
  const { path, doc, source: origin } = parameter,
    now = valueOf(path);
  const set = (value) => change({ ...setting(), set: { ...setting().set, [path]: value } });
  const reset = () => {
    const { [path]: _, ...rest } = setting().set;
    return change({ ...setting(), set: rest });
  };
  return h(
    "div",
    {
      className: `parameter${isChanged(path) ? " changed" : ""}`,
      "data-words": `${path} ${doc}`.toLowerCase(),
      title: origin ?? "",
    },
    h(
      "span",
      { className: "name", id: `name-${path}` },
      path.split(".").pop(),
      h("span", { className: "faint" }, ` ${unitOf(parameter)}`),
    ),
    control(parameter, now, set),
    h(
      "button",
      {
        type: "button",
        disabled: !isChanged(path),
        title: "back to its value before",
        "aria-label": `reset ${path}`,
        onclick: reset,
      },
      "↺",
    ),
    slider(parameter, now, set),
    h("p", { className: "doc" }, plain(doc)),
  );
}

function control(parameter, now, set) {
  const { path, kind, choices, word_for_none: none, is_unlimited: isUnlimited } = parameter;
  const named = { "data-path": path, "aria-labelledby": `name-${path}` };
  if (kind === "switch" || kind === "flag")
    return h("input", {
      type: "checkbox",
      ...named,
      checked: now === true,
      onchange: (event) => set(event.target.checked),
    });
  if (kind === "choice")
    return h(
      "select",
      { ...named, onchange: (event) => set(event.target.value) },
      [...(none ? [{ name: none }] : []), ...choices].map((one) =>
        h(
          "option",
          { value: one.name, title: one.doc ?? "", selected: one.name === now },
          one.name,
        ),
      ),
    );
  if (kind === "list")
    return h("input", {
      ...named,
      value: typeof now === "string" ? now : JSON.stringify(now),
      size: 10,
      onchange: (event) => set(event.target.value),
    });
  const word = none ?? (isUnlimited ? "unlimited" : null);
  const read = (event) => {
    if (event.target.value === "") {
      if (word) set(word);
      return;
    }
    if (Number.isFinite(event.target.valueAsNumber))
      set(fromShown(parameter, event.target.valueAsNumber));
  };
  return h("input", {
    type: "number",
    ...named,
    value: text(parameter, now),
    placeholder: word ?? "",
    step: kind === "whole" ? 1 : "any",
    onchange: read,
  });
}

// A number with as many digits as people write; nothing of a word or of no limit.
function text(parameter, value) {
  return typeof value === "number" && value < 1e15
    ? String(Number(toShown(parameter, value).toPrecision(6)))
    : "";
}

// A slider over what is usual; where that spans more than two powers of ten, by powers.
function slider(parameter, now, set) {
  const { path, kind, slider: usual } = parameter;
  if (!usual || (kind !== "number" && kind !== "whole")) return null;
  const [low, high] = usual.map((end) => toShown(parameter, end)),
    isWide = low > 0 && high / low > 100;
  const value = typeof now === "number" ? toShown(parameter, now) : low;
  const to = (x) => (isWide ? Math.log(x / low) / Math.log(high / low) : (x - low) / (high - low));
  const from = (part) => {
    const x = isWide ? low * (high / low) ** part : low + (high - low) * part;
    return kind === "whole" ? Math.round(x) : Number(x.toPrecision(3));
  };
  return h("input", {
    type: "range",
    min: 0,
    max: 1,
    step: kind === "whole" && !isWide ? 1 / (high - low) : 0.005,
    value: to(value),
    "aria-label": `${path}, slider`,
    "aria-valuetext": String(from(to(value))),
    "data-slider": path,
    oninput: (event) => {
      const x = from(event.target.valueAsNumber);
      event.target.setAttribute("aria-valuetext", String(x));
      set(fromShown(parameter, x));
    },
  });
}

function narrow(words) {
  for (const one of document.querySelectorAll(".parameter"))
    one.hidden = !one.dataset.words.includes(words.toLowerCase());
  for (const group of document.querySelectorAll(".group"))
    group.hidden =
      words !== "" && [...group.querySelectorAll(".parameter")].every((one) => one.hidden);
}

export async function chooseSlot(name) {
  state.slot = name;
  const isNew = !state.pictures[name];
  if (isNew) await load(name);
  tell("slot");
  tell("picture");
  tell("settled");
  if (isNew) scored(name);
}

export async function toggleCompare() {
  state.compare = !state.compare;
  const missing = ["A", "B"].filter((slot) => state.compare && !state.pictures[slot]);
  await Promise.all(missing.map(load));
  await compared();
  if (!state.compare && state.layer === "difference") state.layer = "instances";
  tell("slot");
  tell("compare");
  missing.forEach(scored);
}

async function compared() {
  state.compared = null;
  if (!state.compare) return;
  try {
    state.compared = await source.compare({
      topic: state.topic,
      frame: state.frame,
      first: state.settings.A,
      second: state.settings.B,
    });
  } catch (error) {
    say(error.message, true);
  }
}

// Changes the setting of a slot, clusters again and draws; while that goes on, only the last change
// of many waits.
export function change(next, slot = state.slot) {
  const before = state.settings[slot];
  state.settings[slot] = next;
  return recluster({ slot, before, began: performance.now() });
}

export function apply(set) {
  const next = setting();
  return change({ ...next, set: { ...next.set, ...set } });
}

// Waits until the screen has the picture that is due; of a page that nobody sees not for long.
const isDrawn = () =>
  new Promise((done) => {
    requestAnimationFrame(() => setTimeout(done));
    setTimeout(done, 300);
  });

const recluster = latest(async ({ slot, before, began }) => {
  try {
    await load(slot);
    await compared();
    if (!source.isSaved) state.explanation = null;
    refresh();
    tell("picture");
    await isDrawn();
    latency.ms = performance.now() - began;
    settle(slot, isSliding() ? PAUSE : 0);
  } catch (error) {
    state.settings[slot] = before;
    tell("setting");
    say(error.message, true);
  }
});

const isSliding = () => document.activeElement?.dataset?.slider !== undefined;
const idle = () => JSON.stringify(picture()?.run.idle);

// What stands beside the views follows a slider once it rests: else the lists would hold the views
// up.
const settle = afterPause((slot) => {
  tell("settled");
  scored(slot);
  say(
    `clustered in ${fixed(state.pictures[slot].run.total_ms, 0)} ms, drawn after ${fixed(latency.ms, 0)} ms`,
  );
  tell("changed");
  if (!isSliding() || idle() !== idleWhenBuilt) tell("setting");
});

// Of the rows what a change makes different.
function refresh() {
  for (const one of all()) {
    const field = document.querySelector(`[data-path="${CSS.escape(one.path)}"]`);
    if (!field) continue;
    if (field.type === "number") field.value = text(one, valueOf(one.path));
    const row = field.closest(".parameter");
    row.classList.toggle("changed", isChanged(one.path));
    row.querySelector("button").disabled = !isChanged(one.path);
  }
  figures();
}

// Reads a frame or clusters it again.
export async function load(slot) {
  const request = { ...asked(slot), with_points: !state.points };
  const before = state.pictures[slot] ?? Object.values(state.pictures).find(Boolean);
  const { cloud, run, arrays, sums } = await source.frame(request, state.points ? before : null);
  if (cloud && !state.points) {
    state.cloud = cloud;
    state.points = arrays;
    tell("points");
  }
  state.pictures[slot] = { run, arrays, sums };
  state.scores[slot] = null;
}

// Asks for the scores of what is shown; that of a picture that has gone is not waited for.
export async function scored(slot) {
  const now = state.pictures[slot];
  if (!state.cloud?.has_truth || !now) return;
  const scores = await source.scores(asked(slot)).catch(() => null);
  if (now !== state.pictures[slot]) return;
  state.scores[slot] = scores;
  figures();
}
