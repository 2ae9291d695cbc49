// Why: what is known of a point, and why two points are one instance or not.

import { byId, fixed, grouped, h, plain, say } from "inspect/dom";
import { forgetNode, nodeTable, withNodes } from "inspect/nodes";
import { apply } from "inspect/parameters";
import { source } from "inspect/source";
import { asked, clearSelection, instanceOf, on, picture, state, tell } from "inspect/state";

let turn = 0,
  problem = null,
  isSearching = false;

export function start() {
  on("selection", () => ask(true));
  on("changed slot", askAgain);
  on("explanation slot", build);
  on("frame", () => {
    state.explanation = null;
    forgetNode();
    build();
  });
  on("frame changed slot followed", askTracks);
  build();
}

// Asks again once a slider rests, unless the answer holds for the setting that is chosen now. A
// saved case keeps the answer that it has.
let resting = null,
  askedFor = "";
function askAgain() {
  clearTimeout(resting);
  if (source.isSaved || !state.selected.length) return;
  if (state.explanation && askedFor === JSON.stringify(asked().setting)) return;
  resting = setTimeout(() => ask(false), 150);
}

// Asks about the points that are selected, and shows the answer if they are new.
async function ask(isNew) {
  const own = ++turn;
  problem = null;
  isSearching = false;
  state.explanation = null;
  forgetNode();
  build();
  if (!state.selected.length || !picture()) return tell("explanation");
  askedFor = JSON.stringify(asked().setting);
  try {
    const found = await source.explain({ ...asked(), points: state.selected });
    if (own !== turn) return;
    state.explanation = found;
    if (isNew && state.selected.length === 2) openTab("why");
  } catch (error) {
    if (own !== turn) return;
    problem = error.message;
  }
  tell("explanation");
}

// Searches for the changes that give the other answer.
export async function searchChanges() {
  if (!state.explanation || isSearching) return;
  const own = turn;
  isSearching = true;
  build();
  try {
    const found = await source.changes({ ...asked(), points: state.selected });
    if (own !== turn) return;
    state.explanation = found;
    say("searched for changes that give the other answer");
  } catch (error) {
    if (own !== turn) return;
    if (error.status !== 409) say(error.message, true);
  }
  isSearching = false;
  tell("explanation");
}

export function openTab(name) {
  for (const tab of document.querySelectorAll("[role=tab]")) {
    const isIt = tab.id === `tab-${name}`;
    tab.setAttribute("aria-selected", String(isIt));
    tab.tabIndex = isIt ? 0 : -1;
    byId(tab.getAttribute("aria-controls")).hidden = !isIt;
  }
}

function build() {
  const panel = byId("why"),
    found = state.explanation;
  if (!state.selected.length && !state.instance) {
    panel.replaceChildren(
      h(
        "p",
        {},
        "Click a point to see what became of it; click a second one to see why the two are one instance or not. ",
        h("kbd", {}, "Esc"),
        " begins again.",
      ),
      h(
        "p",
        { className: "faint" },
        "With the keyboard: in the range image the arrow keys move a cursor, Enter selects, Shift and Enter adds the second point; n and p go from instance to instance.",
      ),
    );
    return;
  }
  const parts = [
    h(
      "div",
      { className: "row" },
      h("button", { type: "button", onclick: clearSelection }, "Clear"),
      h(
        "button",
        { type: "button", title: "look at it (f)", onclick: () => tell("show") },
        "Look at it",
      ),
    ),
  ];
  if (problem) parts.push(h("p", { className: "problem-text" }, plain(problem)));
  if (found) parts.push(...explained(found));
  else if (!problem && state.selected.length)
    parts.push(h("p", { className: "faint", "aria-busy": "true" }, "asking …"));
  if (!state.selected.length) parts.push(ofInstance(instanceOf(state.instance)));
  const focused = panel.contains(document.activeElement) && document.activeElement.dataset.node;
  panel.replaceChildren(...parts.filter(Boolean));
  if (focused) panel.querySelector(`[data-node="${focused}"]`)?.focus();
}

const figures = (rows) =>
  h(
    "dl",
    { className: "figures" },
    rows
      .filter(([, value]) => value !== null && value !== undefined && value !== "")
      .flatMap(([name, value]) => [h("dt", {}, name), h("dd", {}, plain(value))]),
  );

function ofInstance(one) {
  if (!one) return h("p", {}, "That instance is not in this setting.");
  return h(
    "div",
    {},
    h("p", { className: "lead" }, plain(one.title)),
    figures([
      ["points", grouped(one.points)],
      ["pixels", grouped(one.pixels)],
      ["components", grouped(one.components)],
      ["confidence", one.confidence === null ? null : `${fixed(100 * one.confidence, 0)} %`],
      ["centre", `${one.centre.map((x) => fixed(x, 2)).join(", ")} m`],
      ["size", `${one.size.map((x) => fixed(x, 2)).join(" × ")} m`],
      ["track", trackOf(one.id)],
    ]),
  );
}

// The object over time that an instance is, once frames were looked through.
const trackOf = (id) => (state.tracks?.[id] ? String(state.tracks[id]) : null);

async function askTracks() {
  state.tracks = null;
  if (!state.survey?.is_followed) return;
  const { topic, frame } = state;
  const tracks = await source.tracks(asked()).catch(() => ({}));
  if (topic !== state.topic || frame !== state.frame) return;
  state.tracks = tracks;
  build();
}

const place = (one) => (one ? `row ${one.row}, column ${one.column}` : null);

function ofPoint(point, name, selected) {
  const { pixel, component, group } = point,
    reason = state.session.colours.reason_words[picture().arrays.reason[selected]];
  return h(
    "div",
    {},
    name ? h("h3", {}, `Point ${name}`) : null,
    figures([
      ["instance", point.instance ? (instanceOf(point.instance)?.title ?? point.instance) : null],
      ["reason", point.instance ? null : reason],
      ["track", trackOf(point.instance)],
      ["class", point.class_name],
      ["point", grouped(point.index)],
      ["position", `${point.position.map((x) => fixed(x, 3)).join(", ")} m`],
      ["range", `${fixed(point.range, 2)} m`],
      ["pixel", pixel && `row ${pixel[0]}, column ${pixel[1]}`],
      ["hidden behind", place(point.hidden_behind)],
      ["label from", place(point.label_from)],
      ["component", component && `${component.label} (${grouped(component.pixels)} pixels)`],
      ["seed", place(component?.seed)],
      [
        "group of the votes",
        group &&
          `${group.number} (${grouped(group.components)} components, ${grouped(group.pixels)} pixels)`,
      ],
    ]),
  );
}

function explained(found) {
  const { report, headline, text } = found,
    two = report.points.length === 2;
  return [
    h("p", { className: "lead" }, plain(headline)),
    ...report.points.map((point, n) => ofPoint(point, two ? "AB"[n] : "", state.selected[n])),
    changes(found),
    votes(report),
    nodeTable(),
    h(
      "details",
      { open: true },
      h("summary", {}, "In words"),
      h("pre", { id: "explanation" }, withNodes(text)),
    ),
  ];
}

// The smallest changes that give the other answer, each a button that makes it.
function changes({ report, changes: all }) {
  if (report.what_if === null) {
    const words = isSearching ? "Searching …" : "What would change it?";
    return h(
      "div",
      {},
      h(
        "button",
        {
          type: "button",
          id: "search-changes",
          disabled: isSearching,
          title: "w",
          onclick: searchChanges,
        },
        words,
      ),
      h(
        "span",
        { className: "faint" },
        isSearching ? " the frame is clustered some hundred times" : " ",
      ),
    );
  }
  const button = (one) =>
    h(
      "button",
      {
        type: "button",
        "data-change": Object.keys(one.set).join(" "),
        onclick: () => apply(one.set),
      },
      `${one.parameter} ${one.words}`,
    );
  return h(
    "div",
    {},
    h("h3", {}, "Changes that give the other answer"),
    all.length
      ? h("div", { className: "changes" }, all.map(button))
      : h("p", { className: "faint" }, "No change of one parameter within what was searched does."),
  );
}

function votes({ votes: evidence, angle_degrees: theta }) {
  const pairs = [
    ...(evidence?.border ?? []),
    ...(evidence?.links ?? []).flatMap((link) => link.pairs),
  ];
  const links = evidence?.links ?? [];
  if (!pairs.length && !links.length) return null;
  const chain = links.length
    ? h(
        "table",
        {},
        h("caption", { className: "faint" }, "Chain of merges"),
        h(
          "thead",
          {},
          h(
            "tr",
            {},
            ["target", "query", "V+", "V-"].map((name) => h("th", { scope: "col" }, name)),
          ),
        ),
        h(
          "tbody",
          {},
          links.map((link) =>
            h(
              "tr",
              {},
              [link.target, link.query, link.positive, link.negative].map((value) =>
                h("td", {}, String(value)),
              ),
            ),
          ),
        ),
      )
    : null;
  const by = ({ rule, beta_degrees: beta }) =>
    rule.by === "nearness"
      ? `${fixed(rule.distance, 2)} of ${fixed(rule.reach, 2)} m`
      : `${fixed(beta, 2)}°`;
  const table = h(
    "table",
    {},
    h(
      "thead",
      {},
      h(
        "tr",
        {},
        ["pixels (row, column)", "beta", "by", "vote"].map((name) =>
          h("th", { scope: "col" }, name),
        ),
      ),
    ),
    h(
      "tbody",
      {},
      pairs
        .slice(0, 60)
        .map((pair) =>
          h(
            "tr",
            {},
            h("td", {}, `${pair.a.row}, ${pair.a.column} – ${pair.b.row}, ${pair.b.column}`),
            h("td", {}, `${fixed(pair.beta_degrees, 2)}°`),
            h("td", {}, by(pair)),
            h("td", {}, pair.holds ? "for" : "against"),
          ),
        ),
    ),
  );
  return h(
    "div",
    {},
    chain,
    h(
      "details",
      { open: pairs.length <= 12 },
      h("summary", {}, `Pairs of pixels that voted (${pairs.length}; theta ${fixed(theta, 2)}°)`),
      table,
    ),
  );
}
