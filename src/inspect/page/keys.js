// Keys that work wherever the focus is, but in a field of text.

import { byId, h } from "inspect/dom";

const ALL = [
  ["j", "next frame", "k", "previous frame"],
  ["1 … 9", "layer"],
  ["n", "next instance", "p", "previous instance"],
  ["f", "look at what is selected", "0", "look at everything"],
  ["Esc", "select nothing"],
  ["o", "boxes", "i", "ids", "v", "votes"],
  ["a", "change setting A", "b", "change setting B", "c", "both side by side"],
  ["w", "what would change the answer"],
  ["/", "search"],
  ["l", "list of cases"],
  ["r", "look through the frames again"],
  ["y", "take along: command, figure, case"],
  ["t", "dark or light"],
  ["?", "this list"],
  ["Tab", "next control"],
  ["arrows", "in a view: turn, move; in the range image: move the cursor", "+ −", "zoom"],
  [
    "Enter",
    "in a view: select the point at the cursor, or in the middle",
    "Shift Enter",
    "second point",
  ],
];

export function start(actions) {
  document.addEventListener("keydown", (event) => {
    const { key, target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]"))
      return;
    const isText = target.matches("textarea, input:not([type=range]):not([type=checkbox])");
    if (isText || (target.matches("select") && key.length === 1)) {
      if (key === "Escape") target.blur();
      return;
    }
    if (!actions(key)) return;
    event.preventDefault();
  });
  byId("help-button").addEventListener("click", help);
  for (const tab of document.querySelectorAll("[role=tab]")) tab.addEventListener("keydown", step);
}

function step(event) {
  const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
  if (!by) return;
  const tabs = [...document.querySelectorAll("[role=tab]")],
    next = tabs[(tabs.indexOf(event.currentTarget) + by + tabs.length) % tabs.length];
  next.click();
  next.focus();
  event.preventDefault();
}

export function help() {
  const rows = ALL.flatMap((row) =>
    Array.from({ length: row.length / 2 }, (_, n) => [
      h(
        "dt",
        {},
        row[2 * n].split(" ").map((one) => [h("kbd", {}, one), " "]),
      ),
      h("dd", {}, row[2 * n + 1]),
    ]),
  );
  byId("help").replaceChildren(
    h("h2", {}, "Keys"),
    h("dl", { className: "keys" }, rows),
    h(
      "p",
      { className: "faint" },
      "Mouse: drag turns and moves, with Shift it moves in space, the wheel zooms, a click selects a point and a second one the other, a double click shows everything.",
    ),
    h("form", { method: "dialog" }, h("button", {}, "Close")),
  );
  byId("help").showModal();
}
