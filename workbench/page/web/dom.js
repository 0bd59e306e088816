// Small helpers of a page.

export const by = (id) => document.getElementById(id);

// An element with properties and children; texts become texts, never markup.
export function make(name, properties = {}, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

// Shows a text, or hides its place where there is none.
export function say(place, text) {
  place.textContent = text ?? "";
  place.hidden = !text;
}

export function list(place, items) {
  place.replaceChildren(...items.map((item) => make("li", {}, item)));
}

// Waits until nothing more is typed.
export function settled(act, after = 250) {
  let timer;
  return () => {
    clearTimeout(timer);
    timer = setTimeout(act, after);
  };
}

export const short = (value) => (value == null ? "–" : String(+value.toPrecision(5)).replace("-", "−"));
