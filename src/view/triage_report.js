"use strict";
(() => {
  const table = document.getElementById("cases");
  const help = document.getElementById("help");
  const rows = () => (table ? [...table.tBodies[0].rows] : []);
  let here = null;

  const go = (row) => {
    if (!row) return;
    if (here) here.classList.remove("here");
    here = row;
    here.classList.add("here");
    here.focus({ preventScroll: true });
    here.scrollIntoView({ block: "nearest" });
  };
  const move = (by) => {
    const all = rows();
    const last = all.length - 1;
    const at = all.indexOf(here);
    const first = by > 0 ? 0 : last;
    go(all[at < 0 ? first : Math.min(Math.max(at + by, 0), last)]);
  };

  const sort = (column) => {
    const heads = [...table.tHead.rows[0].cells];
    const head = heads[column];
    if (!head) return;
    const descending = head.getAttribute("aria-sort") === "ascending";
    heads.forEach((other) => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    const value = (row) => row.cells[column].textContent.trim();
    const compare = head.classList.contains("number")
      ? (a, b) => parseFloat(value(a)) - parseFloat(value(b))
      : (a, b) => value(a).localeCompare(value(b), undefined, { numeric: true });
    const sorted = rows().sort(compare);
    if (descending) sorted.reverse();
    table.tBodies[0].append(...sorted);
  };

  if (table) {
    [...table.tHead.rows[0].cells].forEach((head, column) =>
      head.querySelector("button").addEventListener("click", () => sort(column)));
    rows().forEach((row) => row.addEventListener("click", () => go(row)));
  }

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || (help && help.open)) return;
    const link = (selector) => document.querySelector(selector);
    const follow = (found) => { if (found) { found.click(); event.preventDefault(); } };
    if (event.key === "?") { if (help) help.showModal(); return; }
    if (!table) {
      if (event.key === "j" || event.key === "ArrowRight") follow(link("a[rel=next]"));
      if (event.key === "k" || event.key === "ArrowLeft") follow(link("a[rel=prev]"));
      if (event.key === "u") follow(link("#up"));
      return;
    }
    if (event.key === "j" || event.key === "ArrowDown") { move(1); event.preventDefault(); }
    if (event.key === "k" || event.key === "ArrowUp") { move(-1); event.preventDefault(); }
    if (event.key === "Enter" && here && document.activeElement === here) {
      follow(here.querySelector("a"));
    }
    if (event.key === "u") { location.hash = "top"; go(here || rows()[0]); }
    if (/^[1-7]$/.test(event.key)) sort(Number(event.key) - 1);
  });
})();
