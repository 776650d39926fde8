// Small functions for the page's elements. They touch an element only when something changes, so that focus and selections stay.

export const $ = (id) => document.getElementById(id);

export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
export function setHidden(element, hidden) {
  if (element.hidden !== hidden) element.hidden = hidden;
}
export function setClass(element, name) {
  if (element.className !== name) element.className = name;
}

/// Makes an element: make('button', {class: 'x', onclick}, 'text', child...). Options that are properties of the element are set
/// as properties, others as attributes.
export function make(tag, options = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(options)) {
    if (key === 'class') element.className = value;
    else if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

const nameOf = (control) => control.href || control.name || control.textContent;

/// Calls build() for new children of the element only when `content` (any JSON value) differs from that shown last. The
/// control that has the focus keeps it.
export function showList(element, content, build) {
  const key = JSON.stringify(content);
  if (element.shown === key) return;
  element.shown = key;
  const focused = element.contains(document.activeElement) && nameOf(document.activeElement);
  element.replaceChildren(...build());
  if (focused) [...element.querySelectorAll('a, button, input, select')].find((e) => nameOf(e) === focused)?.focus({ preventScroll: true });
}

/// Makes a sign to stand beside a coloured element, because the meaning must not depend on the colour.
export const sign = (level) =>
  make('span', { class: `sign ${level}`, 'aria-hidden': 'true' }, level === 'error' || level === 'warning' ? '!' : level === 'ok' ? '✓' : '•');
