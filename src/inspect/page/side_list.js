// The worst cases of many frames, one entry per object over time; and the instances of this frame.

import { swatch } from "inspect/colours";
import { byId, counted, fixed, grouped, h, plain, say } from "inspect/dom";
import { source } from "inspect/source";
import { on, picture, selectPoints, state, tell } from "inspect/state";

const filter = { source: "all", kind: "all", words: "" };
let goTo = null,
  timer = null;

export function start(jump) {
  goTo = jump;
  on("survey", listCases);
  on("settled", listInstances);
  on("selection frame", mark);
  build();
}

function build() {
  const choose = (name) => (event) => {
    filter[name] = event.target.value;
    listCases();
  };
  const last = Math.max((clouds() || 1) - 1, 0);
  byId("list").replaceChildren(
    h(
      "div",
      { className: "tools" },
      h(
        "div",
        { className: "row" },
        h(
          "button",
          {
            type: "button",
            id: "survey",
            disabled: source.isSaved,
            title: "find the worst cases of these frames (r)",
            onclick: lookOrStop,
          },
          "Look through",
        ),
        h("input", {
          id: "survey-from",
          type: "number",
          min: 0,
          value: state.frame,
          "aria-label": "first frame",
        }),
        "to",
        h("input", {
          id: "survey-to",
          type: "number",
          min: 0,
          value: Math.min(state.frame + 9, last),
          "aria-label": "last frame",
        }),
      ),
      h("div", { id: "survey-progress" }),
      h(
        "div",
        { className: "row" },
        h(
          "select",
          {
            id: "survey-source",
            "aria-label": "where cases come from",
            onchange: choose("source"),
          },
          ["all", "triage", "failures"].map((one) => h("option", { value: one }, one)),
        ),
        h(
          "select",
          { id: "survey-kind", "aria-label": "kind of case", onchange: choose("kind") },
          h("option", { value: "all" }, "all kinds"),
        ),
      ),
      h("input", {
        id: "search",
        type: "search",
        placeholder: "id, class, >points or <points  ( / )",
        "aria-label": "search instances by id, class or size",
        oninput: (event) => {
          filter.words = event.target.value;
          listCases();
          listInstances();
        },
      }),
    ),
    h("h2", { className: "tools", id: "cases-head" }, "Cases"),
    h("ol", { className: "cases", id: "cases" }),
    h("h2", { className: "tools" }, "Instances of this frame"),
    h("ol", { className: "cases", id: "instances" }),
  );
  listCases();
}

const clouds = () => state.session.topics.find((one) => one.topic === state.topic)?.clouds ?? 0;

// Most milliseconds that a frame takes to be clustered if its neighbours are looked through unasked.
const QUICK = 400;

// Looks through the frame that is shown, and where that is quick and comes from this machine through
// the next ones too, so that objects are followed.
export function lookAround() {
  const [first, last] = state.cloud.messages,
    isQuick = picture().run.total_ms < QUICK && !state.session.is_remote;
  return look(first, isQuick ? Number(byId("survey-to").value) : last);
}

// Looks through frames, or stops doing so.
async function lookOrStop() {
  if (state.survey && !state.survey.is_over) return follow(await source.stopSurvey());
  return look(Number(byId("survey-from").value), Number(byId("survey-to").value));
}

// Looks through frames, from the first to the last.
export async function look(first, last) {
  if (source.isSaved) return;
  try {
    const survey = await source.survey({
      topic: state.topic,
      frames: [first, last + 1],
      setting: state.settings[state.slot],
    });
    follow(survey);
  } catch (error) {
    say(error.message, true);
  }
}

function follow(survey) {
  const isNews = survey.is_followed && !state.survey?.is_followed;
  state.survey = survey;
  tell("survey");
  if (isNews) tell("followed");
  clearTimeout(timer);
  if (!survey.is_over)
    timer = setTimeout(
      async () => follow(await source.surveyState().catch(() => ({ ...survey, is_over: true }))),
      400,
    );
}

// One entry per object over time: its worst case, and in how many frames it is listed.
function entries(cases) {
  const byTrack = new Map(),
    all = [];
  for (const one of cases) {
    const key = one.track ? `${one.source} ${one.track}` : null,
      before = key && byTrack.get(key);
    if (before) {
      before.frames.add(one.frame);
      continue;
    }
    const entry = { ...one, frames: new Set([one.frame]) };
    all.push(entry);
    if (key) byTrack.set(key, entry);
  }
  return all;
}

// Whether something of an id, a class and a size is what is searched for.
function fits({ id, title, size }) {
  const words = filter.words.trim().toLowerCase(),
    bound = words.match(/^([<>])\s*(\d+)$/);
  if (!words) return true;
  if (bound) return bound[1] === ">" ? size > Number(bound[2]) : size < Number(bound[2]);
  if (/^\d+$/.test(words)) return id === Number(words);
  return title.toLowerCase().includes(words);
}

function listCases() {
  const survey = state.survey ?? { cases: [], done: 0, of: 0, is_over: true },
    list = byId("cases");
  if (!list) return;
  const kinds = [...new Set(survey.cases.map((one) => one.kind))].sort(),
    select = byId("survey-kind");
  if (select.options.length !== kinds.length + 1) {
    select.replaceChildren(
      h("option", { value: "all" }, "all kinds"),
      ...kinds.map((one) => h("option", { value: one, selected: one === filter.kind }, one)),
    );
  }
  const chosen = survey.cases.filter(
    (one) =>
      (filter.source === "all" || one.source === filter.source) &&
      (filter.kind === "all" || one.kind === filter.kind) &&
      fits({ id: one.instance, title: `${one.title} ${one.class}`, size: one.size }),
  );
  const shown = entries(chosen);
  byId("survey").textContent = survey.is_over ? "Look through" : "Stop";
  byId("cases-head").textContent = `Cases (${grouped(shown.length)})`;
  list.replaceChildren(...shown.slice(0, 200).map(caseEntry));
  byId("survey-progress").replaceChildren(...progress(survey));
  mark();
}

// What is counted: messages, where several are put together to a cloud.
const unit = () => {
  const [first, last] = state.cloud?.messages ?? [0, 0];
  return first < last ? "message" : "frame";
};

function progress(survey) {
  if (survey.problem) return [h("p", { className: "problem-text" }, plain(survey.problem))];
  if (!survey.of) return [];
  const words = survey.is_over
    ? counted(survey.done, unit())
    : `${survey.done} of ${survey.of} ${unit()}s${survey.done === survey.of ? ", following objects" : ""}`;
  return [
    survey.is_over
      ? null
      : h("progress", {
          max: survey.of,
          value: survey.done,
          "aria-label": "frames looked through",
        }),
    h("span", { className: "faint" }, words),
  ].filter(Boolean);
}

function caseEntry(one) {
  const image = one.thumbnail
    ? h("img", { src: `data:image/png;base64,${one.thumbnail}`, alt: "" })
    : h("span", { className: "none" });
  const score = h(
    "span",
    { className: "score" },
    one.source === "failures" ? (one.cause ?? "failure") : `${fixed(100 * one.score, 0)} %`,
  );
  if (one.source !== "failures") score.style.setProperty("--part", `${100 * one.score}%`);
  const when =
    one.frames.size > 1
      ? `frame ${one.frame} and ${one.frames.size - 1} more`
      : `frame ${one.frame}`;
  return h(
    "li",
    {},
    h(
      "button",
      {
        type: "button",
        "data-frame": one.frame,
        "data-points": one.points.join(","),
        onclick: () => goTo(one),
      },
      image,
      h(
        "span",
        {},
        h("span", { className: "kind" }, h("b", {}, plain(one.kind)), score),
        h("span", { className: "faint" }, `${when}  ${plain(one.title)}`),
      ),
      h("span", { className: "what" }, plain(one.sentence)),
    ),
  );
}

function listInstances() {
  const list = byId("instances");
  if (!list || !picture()) return;
  const all = picture()
    .run.instances.filter((one) => fits({ id: one.id, title: one.title, size: one.points }))
    .sort((a, b) => b.points - a.points);
  list.replaceChildren(
    ...all.slice(0, 300).map((one) => {
      const sign = h("span", { className: "swatch" });
      sign.style.background = swatch(one.id);
      return h(
        "li",
        {},
        h(
          "button",
          {
            type: "button",
            "data-instance": one.id,
            onclick: () => {
              selectPoints([], one.id);
              tell("show");
            },
          },
          h("span", {}, sign, String(one.id)),
          h(
            "span",
            {},
            plain(one.title.replace(/^\d+ ?/, "") || one.class || "instance"),
            h("span", { className: "faint" }, `  ${counted(one.points, "point")}`),
          ),
        ),
      );
    }),
  );
  mark();
}

function mark() {
  for (const button of document.querySelectorAll("#cases button")) {
    button.setAttribute(
      "aria-current",
      String(
        Number(button.dataset.frame) === state.frame &&
          state.selected.length > 0 &&
          button.dataset.points === state.selected.join(","),
      ),
    );
  }
  for (const button of document.querySelectorAll("#instances button"))
    button.setAttribute("aria-current", String(Number(button.dataset.instance) === state.instance));
}

// Goes to the next instance of the frame, by size, or back.
export function stepInstance(by) {
  const all = [...(picture()?.run.instances ?? [])].sort((a, b) => b.points - a.points);
  if (!all.length) return;
  const now = all.findIndex((one) => one.id === state.instance);
  selectPoints([], all[(now + by + all.length) % all.length].id);
  tell("show");
}

export function toggleList() {
  const isOpen = !document.body.classList.toggle("no-list");
  byId("list-button").setAttribute("aria-expanded", String(isOpen));
  tell("view");
}
