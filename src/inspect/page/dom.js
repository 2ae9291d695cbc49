// Elements from code. Text is always text: nothing here reads markup.

// An element with properties and children; strings become text.
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name in element && name !== "list") element[name] = value;
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

export const byId = (id) => document.getElementById(id);

// Text of the recording without what a reader cannot see.
export const plain = (text) =>
  String(text).replace(
    /[\u0000-\u0008\u000b-\u001f\u007f-\u009f\u202a-\u202e\u2066-\u2069]/g,
    "\ufffd",
  );

export function say(words, isProblem = false) {
  const status = byId("status");
  status.textContent = plain(words);
  status.title = status.textContent;
  status.classList.toggle("problem", isProblem);
}

export const grouped = (number) => String(number).replace(/\B(?=(\d{3})+$)/g, ",");
export const counted = (count, noun) => `${grouped(count)} ${noun}${count === 1 ? "" : "s"}`;
export const fixed = (number, digits) => (Number.isFinite(number) ? number.toFixed(digits) : "–");
export const css = ([r, g, b], alpha = 1) => `rgb(${r} ${g} ${b} / ${alpha})`;

// Calls a function with the latest argument, one call at a time.
export function latest(call) {
  let waiting = null,
    busy = null;
  const go = async () => {
    while (waiting) {
      const { argument } = waiting;
      waiting = null;
      await call(argument);
    }
    busy = null;
  };
  return (argument) => {
    waiting = { argument };
    return (busy ??= go());
  };
}

// Calls a function with the latest argument, once none has come for so many milliseconds.
export function afterPause(call) {
  let timer;
  return (argument, pause) => {
    clearTimeout(timer);
    timer = setTimeout(() => call(argument), pause);
  };
}
