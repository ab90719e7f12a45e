// Making and changing elements. Text is always text: nothing here takes markup.

const SVG = "http://www.w3.org/2000/svg";

/**
 * An element. `properties`: `class`, `on<event>` functions, `data` {name: value}, anything else an attribute (true: empty, false and
 * null: none). Children are nodes, text, or null for nothing.
 */
export function h(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  assign(element, properties);
  append(element, children);
  return element;
}

/** The same in SVG. */
export function s(tag, properties = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  assign(element, properties);
  append(element, children);
  return element;
}

function assign(element, properties) {
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "data") Object.assign(element.dataset, value);
    else if (name === "value") element.value = value;
    else if (name === "checked") element.checked = Boolean(value);
    else element.setAttribute(name, value === true ? "" : value);
  }
}

function append(element, children) {
  for (const child of children.flat(Infinity)) {
    if (child === null || child === undefined || child === false) continue;
    element.append(child);
  }
}

/** Puts the symbols of `icons.svg` into the page once: a reference into a file of its own would blink each time it is made. */
export async function loadIcons() {
  try {
    const response = await fetch("/app/icons.svg");
    const sheet = new DOMParser().parseFromString(await response.text(), "image/svg+xml").documentElement;
    for (const symbol of sheet.querySelectorAll("symbol")) symbol.id = `icon-${symbol.id}`;
    sheet.setAttribute("class", "unseen");
    sheet.setAttribute("aria-hidden", "true");
    document.body.prepend(document.importNode(sheet, true));
  } catch {
    // Every icon has words beside it.
  }
}

/** An icon of `icons.svg`; decoration only. */
export function icon(name) {
  return s("svg", { class: "icon", "aria-hidden": "true", focusable: "false" }, s("use", { href: `#icon-${name}` }));
}

/** Shows another icon in an element that `icon` made. */
export function setIcon(svg, name) {
  const use = svg.firstElementChild;
  const href = `#icon-${name}`;
  if (use.getAttribute("href") !== href) use.setAttribute("href", href);
}

/** Writes text only when it differs, so that screen readers and layout are left alone. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

export function setData(element, name, value) {
  const next = String(value);
  if (element.dataset[name] !== next) element.dataset[name] = next;
}

export function show(element, visible) {
  if (element.hidden === visible) element.hidden = !visible;
}

/** Replaces all children. */
export function fill(element, ...children) {
  element.replaceChildren();
  append(element, children);
}

/** A button with an icon and a label. */
export function button(label, iconName, properties = {}) {
  const { class: more = "", ...rest } = properties;
  return h("button", { type: "button", class: `button ${more}`.trim(), ...rest }, iconName ? icon(iconName) : null, h("span", { class: "label" }, label));
}

/** A button of an icon alone, with its name for those who cannot see it. */
export function iconButton(label, iconName, properties = {}) {
  const { class: more = "", ...rest } = properties;
  return h("button", { type: "button", class: `icon-button ${more}`.trim(), "aria-label": label, title: label, ...rest }, icon(iconName));
}
