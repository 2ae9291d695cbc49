// Starts the page: reads the session, shows the first frame, and goes from frame to frame.

import { LAYERS } from "inspect/colours";
import { byId, fixed, h, latest, plain, say } from "inspect/dom";
import * as keys from "inspect/keys";
import * as parameters from "inspect/parameters";
import * as pointing from "inspect/pointing";
import * as sideList from "inspect/side_list";
import { savedCase, source } from "inspect/source";
import { clearSelection, on, picture, selectPoints, state, tell } from "inspect/state";
import * as takeAlong from "inspect/take_along";
import * as views from "inspect/views";
import * as why from "inspect/why";

const clouds = () => state.session.topics.find((one) => one.topic === state.topic)?.clouds ?? 0;

// Shows a frame, in the settings that are there.
const showFrame = latest(async ({ topic, frame, points, instance }) => {
  if (frame < 0 || frame >= clouds()) return say(`${topic} has ${clouds()} frames, from 0`, true);
  Object.assign(state, {
    topic,
    frame,
    points: null,
    cloud: null,
    compared: null,
    selected: [],
    instance: 0,
    explanation: null,
  });
  state.pictures = { A: null, B: null };
  try {
    await parameters.load("A");
    if (state.compare || state.slot === "B") await parameters.load("B");
  } catch (error) {
    say(error.message, true);
    tell("frame");
    return;
  }
  if (state.compare)
    await source.compare({ topic, frame, first: state.settings.A, second: state.settings.B }).then(
      (found) => {
        state.compared = found;
      },
      () => {},
    );
  if (!state.wasShown) {
    views.home();
    state.wasShown = true;
  }
  tell("picture");
  const { run } = picture();
  state.frame = state.cloud.frame;
  tell("frame");
  tell("settled");
  for (const slot of ["A", "B"]) parameters.scored(slot);
  say(`${run.instances.length} instances, clustered in ${fixed(run.total_ms, 0)} ms`);
  if (points || instance) {
    selectPoints(points ?? [], instance);
    views.showSelected();
  }
});

// The next cloud, or the one before: of several messages, where they are put together.
const step = (by) => {
  const [first, last] = state.cloud?.messages ?? [state.frame, state.frame];
  return showFrame({ topic: state.topic, frame: by > 0 ? last + by : first + by });
};
// Goes to a case of the list.
const goTo = (one) => {
  if (one.frame === state.frame) {
    selectPoints(one.points, one.instance || undefined);
    views.showSelected();
    return;
  }
  showFrame({
    topic: state.topic,
    frame: one.frame,
    points: one.points,
    instance: one.instance || undefined,
  });
};

function head() {
  const { session, cloud } = state;
  document.title = `${plain(session.name)} – divmerge inspect`;
  byId("name").textContent = plain(session.name);
  byId("name").title = plain(session.name);
  byId("topic").replaceChildren(
    ...session.topics.map((one) =>
      h("option", { value: one.topic, selected: one.topic === state.topic }, plain(one.topic)),
    ),
  );
  byId("frame").value = state.frame;
  byId("frame").max = Math.max(clouds() - 1, 0);
  const [first, last] = cloud?.messages ?? [state.frame, state.frame];
  byId("of").textContent = first < last ? `of ${clouds()}: ${first} to ${last}` : `of ${clouds()}`;
  byId("time").textContent = cloud ? `${fixed(cloud.seconds, 3)} s` : "";
  byId("back").disabled = first <= 0 || source.isSaved;
  byId("on").disabled = last >= clouds() - 1 || source.isSaved;
  for (const id of ["topic", "frame"]) byId(id).disabled = source.isSaved;
  about();
}

// What is known of the frame.
function about() {
  const { cloud } = state;
  if (!cloud || !picture()) return;
  const { run } = picture(),
    { colours } = state.session;
  const rows = [
    ["recording", state.session.name],
    ["topic", cloud.topic],
    ["frame", `${cloud.frame}, ${fixed(cloud.seconds, 3)} s`],
    ["coordinate frame", cloud.frame_id || "–"],
    ["points", cloud.points],
    ["range image", `${run.rows} × ${run.columns}`],
    ["objects", cloud.semantics],
    ["method", run.method],
    ...run.reasons.flatMap((count, n) =>
      n > 0 && count ? [[colours.reason_words[n], `${count} points`]] : [],
    ),
    ...Object.entries(run.times).map(([name, ms]) => [
      name.replace("_ms", ""),
      `${fixed(ms, 2)} ms`,
    ]),
  ];
  byId("about").replaceChildren(
    h("p", { className: "lead", id: "heading" }, plain(run.heading)),
    h("p", { id: "remark" }, plain(run.remark)),
    ...leftOut(),
    ...cloud.remarks.map((words) => h("p", {}, plain(words))),
    h(
      "dl",
      { className: "figures" },
      rows.flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, plain(value))]),
    ),
  );
}

// What a saved case does not have.
function leftOut() {
  const words = savedCase?.left_out ?? [];
  if (!words.length) return [];
  return [
    h("h3", {}, "Left out, so that the file is small"),
    h("ul", { className: "left-out" }, words.map((one) => h("li", {}, plain(one)))),
  ];
}

function theme(next) {
  const root = document.documentElement;
  const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = next ?? (isDark ? "dark" : "light");
}
const otherTheme = () =>
  theme(document.documentElement.dataset.theme === "dark" ? "light" : "dark");

const ACTIONS = {
  j: () => step(1),
  k: () => step(-1),
  n: () => sideList.stepInstance(1),
  p: () => sideList.stepInstance(-1),
  f: () => views.showSelected(),
  0: () => views.home(),
  Escape: clearSelection,
  o: () => views.toggle("boxes"),
  i: () => views.toggle("ids"),
  v: () => views.toggle("votes"),
  a: () => parameters.chooseSlot("A"),
  b: () => parameters.chooseSlot("B"),
  c: () => parameters.toggleCompare(),
  w: () => {
    why.openTab("why");
    why.searchChanges();
  },
  "/": () => {
    if (document.body.classList.contains("no-list")) sideList.toggleList();
    byId("search").focus();
  },
  l: () => sideList.toggleList(),
  r: () => byId("survey").click(),
  y: () => takeAlong.open(),
  t: otherTheme,
  "?": () => keys.help(),
};

function actions(key) {
  if (/^[1-9]$/.test(key)) {
    views.setLayer(LAYERS[Number(key) - 1][0]);
    return true;
  }
  ACTIONS[key]?.();
  return key in ACTIONS;
}

async function start() {
  theme();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => theme());
  if (innerWidth <= 1150) document.body.classList.add("no-list");
  byId("list-button").setAttribute("aria-expanded", String(innerWidth > 1150));
  state.session = await source.session();
  Object.assign(state, {
    topic: savedCase?.topic ?? state.session.topic,
    frame: savedCase?.frame ?? state.session.frame,
  });
  if (savedCase) state.settings.A = savedCase.setting;
  views.start();
  pointing.start();
  parameters.start();
  why.start();
  sideList.start(goTo);
  keys.start(actions);
  on("frame settled", head);
  on("show", () => views.showSelected());
  byId("back").onclick = () => step(-1);
  byId("on").onclick = () => step(1);
  byId("frame").onchange = (event) =>
    showFrame({ topic: state.topic, frame: Number(event.target.value) });
  byId("topic").onchange = (event) => showFrame({ topic: event.target.value, frame: 0 });
  byId("theme").onclick = otherTheme;
  byId("list-button").onclick = () => sideList.toggleList();
  byId("take-button").onclick = () => takeAlong.open();
  for (const tab of document.querySelectorAll("[role=tab]"))
    tab.onclick = () => why.openTab(tab.id.slice(4));
  head();
  await showFrame({ topic: state.topic, frame: state.frame });
  if (savedCase) openCase();
  else if (picture()) sideList.lookAround();
}

// A saved case as it was left.
function openCase() {
  const { shown, explanation } = savedCase;
  Object.assign(state, { layer: shown.layer ?? state.layer });
  Object.assign(state.shown, shown.shown);
  selectPoints(shown.points ?? [], shown.instance || undefined);
  views.showSelected();
  if (explanation) why.openTab("why");
  const missing = savedCase.left_out?.length;
  say(missing ? "a saved case: the tab Frame lists what was left out" : "a saved case");
}

// For people at the console, and for tests.
window.inspector = { state, views, latency: parameters.latency, actions, measured: views.measured };
start().catch((error) => {
  say(error.message, true);
  throw error;
});
