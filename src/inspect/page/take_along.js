// Take along: commands, figures, and the case as one file.

import { plane } from "inspect/camera";
import { byId, h, say } from "inspect/dom";
import { source } from "inspect/source";
import { asked, state } from "inspect/state";
import { snapshot } from "inspect/views";

const COMMANDS = [
  ["explain", "Explain"],
  ["figure", "Figure"],
  ["annotate", "Annotate"],
  ["inspect", "Inspect"],
];
let kind = "figure";

const request = (more) => ({ ...asked(), points: state.selected, ...more });

export async function open() {
  const dialog = byId("take");
  kind = state.selected.length ? "explain" : "figure";
  dialog.replaceChildren(
    h("h2", {}, "Take along"),
    source.isSaved
      ? h(
          "p",
          {},
          "This is a saved case: it has no server to make figures and commands. A picture of the views can be saved.",
        )
      : h("div", {}, commandPart(), figurePart()),
    h("h3", {}, "Views as they are"),
    h(
      "button",
      { type: "button", onclick: () => snapshot().then((blob) => save(blob, "png", "views")) },
      "Save picture (PNG)",
    ),
    h(
      "form",
      { method: "dialog", className: "row" },
      h("span", { className: "fill" }),
      h("button", {}, "Close"),
    ),
  );
  dialog.showModal();
  if (!source.isSaved) await command();
}

function commandPart() {
  const button = ([name, words]) =>
    h(
      "button",
      {
        type: "button",
        role: "radio",
        "aria-checked": String(name === kind),
        "data-kind": name,
        onclick: () => {
          kind = name;
          command();
        },
      },
      words,
    );
  return h(
    "div",
    {},
    h("h3", {}, "The command that gives what is seen"),
    h(
      "div",
      { className: "row", role: "radiogroup", "aria-label": "command" },
      COMMANDS.map(button),
    ),
    h("textarea", {
      id: "command",
      readOnly: true,
      "aria-label": "command line",
      spellcheck: false,
    }),
    h("button", { type: "button", id: "copy", onclick: copy }, "Copy command"),
  );
}

function figurePart() {
  const figure = (format, dark) =>
    h(
      "button",
      {
        type: "button",
        "data-figure": `${format}-${dark ? "dark" : "light"}`,
        onclick: () => saveFigure(format, dark),
      },
      `${format.toUpperCase()}, ${dark ? "dark" : "light"}`,
    );
  return h(
    "div",
    {},
    h("h3", {}, state.selected.length ? "Figure of the explanation" : "Figure of the frame"),
    h(
      "div",
      { className: "row" },
      figure("svg", false),
      figure("svg", true),
      figure("png", false),
      figure("png", true),
      figure("pdf", false),
      figure("pdf", true),
    ),
    h("h3", {}, "Case"),
    h(
      "p",
      { className: "faint" },
      "One HTML file that opens without a server: this frame, what is selected, its explanation, and what each change that gives the other answer leads to.",
    ),
    h("button", { type: "button", id: "save-case", onclick: saveCase }, "Save case"),
  );
}

async function command() {
  for (const button of document.querySelectorAll("[data-kind]"))
    button.setAttribute("aria-checked", String(button.dataset.kind === kind));
  const box = byId("command");
  if (kind === "explain" && !state.selected.length) {
    box.value = "Select one or two points first.";
    return;
  }
  try {
    box.value = (await source.command(request({ command: kind }))).command;
  } catch (error) {
    box.value = error.message;
  }
}

export async function copy() {
  const box = byId("command");
  try {
    await navigator.clipboard.writeText(box.value);
    say("copied");
  } catch {
    box.select();
    say(document.execCommand("copy") ? "copied" : "select the command and copy it");
  }
}

async function saveFigure(format, dark) {
  say("drawing …");
  const reach = [plane.metres / 2, plane.metres / 3];
  const view = [
    [plane.x - reach[0], plane.x + reach[0]],
    [plane.y - reach[1], plane.y + reach[1]],
  ];
  try {
    save(
      await source.file("figure", request({ figure: { format, dark, view } })),
      format,
      "figure",
    );
  } catch (error) {
    say(error.message, true);
  }
}

async function saveCase() {
  say("saving: changes are searched for and run …");
  const { layer, shown, selected: points, instance } = state;
  try {
    save(
      await source.file(
        "case",
        request({ shown: { layer, shown, points, instance, slot: state.slot } }),
      ),
      "html",
      "case",
    );
  } catch (error) {
    say(error.message, true);
  }
}

function save(blob, ending, what) {
  const name =
    `${state.session.name.replace(/\.[^.]*$/, "")}-${state.frame}-${what}.${ending}`.replace(
      /[^\w.-]+/g,
      "_",
    );
  const link = h("a", { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  say(`saved ${name} (${(blob.size / 1e6).toFixed(1)} MB)`);
}
