// The last lines of the log: newest below, filtered by sonar and level.
import { $, make, showList } from '../dom.js';
import { clockTime, fixed } from '../numbers.js';

const names = { 3: 'warning', 4: 'error', 5: 'error' };
const near_end_px = 30;
const field = / +([a-z_]+)=("(?:[^"\\]|\\.)*"|\S*)/g;

/// Splits a line, without its field `hidden`. "viewer connected  from=\"http 127.0.0.1\"  steers=yes" becomes
/// {words: 'viewer connected', fields: 'from http 127.0.0.1 · steers yes'}.
export function partsOf(message, hidden = '') {
  const fields = [];
  const words = message.replace(field, (_, key, value) => {
    if (key !== hidden) fields.push(`${key.replace(/_/g, ' ')} ${value.replace(/^"|"$/g, '')}`);
    return '';
  });
  return { words, fields: fields.join(' · ') };
}

export class LogPane {
  constructor(facts) {
    this.facts = facts;
    this.shown = 0;  // logCount of the last line that is shown
    for (const id of ['log-sonar', 'log-level']) $(id).addEventListener('change', () => this.again());
  }

  again() {
    this.shown = this.facts.logCount - this.facts.log.length;
    $('log').replaceChildren();
    this.draw();
  }

  line(entry) {
    const level = names[entry.level] ?? '';
    const time = this.facts.realtime ? clockTime(entry.ns) : `${fixed(entry.ns / 1e9, 3)} s`;
    const { words, fields } = partsOf(entry.message, this.facts.status.sonars.length > 1 ? '' : 'sonar');
    const text = make('span', {}, level && make('span', { class: 'unseen' }, `${level}: `), words, fields && make('small', {}, ` ${fields}`));
    return make('div', { class: `log-line ${level}` }, make('time', {}, time), text);
  }

  draw() {
    const { facts } = this;
    if (!facts.status) return;
    const sonars = facts.status.sonars.map((s) => s.name);
    showList($('log-sonar'), sonars, () => [['', 'all'], ...sonars.map((s) => [s, s]), ['sonard', 'sonard']].map(([value, text]) => make('option', { value }, text)));
    const fresh = Math.min(facts.log.length, facts.logCount - this.shown);
    if (fresh <= 0) return;
    const box = $('log');
    const at_end = box.scrollHeight - box.scrollTop - box.clientHeight < near_end_px;
    const [sonar, level] = [$('log-sonar').value, Number($('log-level').value)];
    const wanted = facts.log.slice(-fresh).filter((entry) => (!sonar || entry.name === sonar) && (entry.level || 2) >= level);
    box.append(...wanted.map((entry) => this.line(entry)));
    while (box.children.length > 500) box.firstChild.remove();
    this.shown = facts.logCount;
    if (at_end) box.scrollTop = box.scrollHeight;
  }
}
