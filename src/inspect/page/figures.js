import { byId, counted, fixed, grouped, h } from "inspect/dom";
import { instanceOf, picture, select, state, tell } from "inspect/state";

// What was found, in figures; with a second setting what it makes different.
export function figures() {
  const box = byId("figures");
  if (!box || !picture()) return;
  const shown = state.compare && state.pictures.B ? ["A", "B"] : [state.slot];
  const row = (name, value) =>
    h(
      "tr",
      {},
      h("th", { scope: "row" }, name),
      shown.map((slot) => h("td", { className: "number" }, value(slot))),
    );
  const run = (slot) => state.pictures[slot].run,
    scores = (slot) => state.scores[slot];
  const rows = [
    row("instances", (slot) => grouped(run(slot).instances.length)),
    row("objects", (slot) => grouped(run(slot).instances.filter((one) => one.is_object).length)),
    row("components", (slot) => grouped(run(slot).components)),
    row("milliseconds", (slot) => fixed(run(slot).total_ms, 1)),
  ];
  if (shown.some(scores)) {
    const percent = (value) =>
      value === null || value === undefined ? "–" : `${fixed(100 * value, 1)} %`;
    rows.push(
      row("found whole", (slot) =>
        scores(slot) ? `${scores(slot).found_whole} of ${scores(slot).objects}` : "…",
      ),
    );
    rows.push(
      row(
        "failures",
        (slot) =>
          scores(slot)
            ?.verdicts.map(([name, count]) => `${count} ${name}`)
            .join(", ") || (scores(slot) ? "none" : "…"),
      ),
    );
    if (shown.some((slot) => scores(slot)?.pq !== null))
      rows.push(row("PQ of things here", (slot) => percent(scores(slot)?.pq)));
  }
  const head =
    shown.length > 1
      ? h(
          "thead",
          {},
          h(
            "tr",
            {},
            h("td"),
            shown.map((slot) => h("th", { scope: "col", className: "number" }, slot)),
          ),
        )
      : null;
  box.replaceChildren(h("table", {}, head, h("tbody", {}, rows)), ...differences());
}

function differences() {
  const { compared: found } = state;
  if (!state.compare || !found) return [];
  if (!found.differences.length) return [h("p", {}, "A and B are the same.")];
  const words = found.counts.map(([name, count]) => `${count} ${name}`).join(", ");
  const title = (one, side, slot) =>
    one[side].map((id) => instanceOf(id, slot)?.title ?? id).join(" + ") || "–";
  return [
    h("h3", {}, `What differs: ${words}`),
    h(
      "div",
      { className: "changes" },
      found.differences.slice(0, 40).map((one) =>
        h(
          "button",
          {
            type: "button",
            onclick: () => {
              select(one.example);
              tell("show");
            },
          },
          `${one.change}: ${title(one, "first", "A")} → ${title(one, "second", "B")} (${counted(one.points, "point")})`,
        ),
      ),
    ),
  ];
}
