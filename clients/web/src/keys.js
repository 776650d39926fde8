// Keys of the page, and the list of them. They have no effect while a field has the focus, or with Ctrl, Alt or Meta.
import { $, make } from './dom.js';

const in_field = (element) => element?.matches?.('input:not([type=range]), select, textarea, [contenteditable]') || $('help').open;

/// `keys`: [[keys of one action, ...], name of the keys, what they do, action]
export function listenToKeys(keys) {
  $('help-keys').append(...keys.flatMap(([, name, what]) => [make('dt', {}, make('kbd', {}, name)), make('dd', {}, what)]));
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || in_field(event.target)) return;
    const arrow = event.key.startsWith('Arrow') && event.target.matches('[type=range]');
    const press = event.key === ' ' && event.target.matches('button, summary');
    if (arrow || press) return;  // the control handles this key
    const entry = keys.find(([names]) => names.includes(event.key));
    if (!entry) return;
    event.preventDefault();
    entry[3](event.key);
  });
}
