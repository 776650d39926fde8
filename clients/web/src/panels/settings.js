// Settings of the sonar and the water: the present values, and a field for each that may be changed.
import { $, make, setText, showList } from '../dom.js';
import { dash, fixed, short } from '../numbers.js';

const numbers = [
  { name: 'range_m', label: 'range', unit: 'm', step: 'any' },
  { name: 'rate_hz', label: 'rate', unit: 'Hz', step: 'any', zero: 'standby' },
  { name: 'gain_percent', label: 'gain', unit: '%', step: 1 },
];
const water = [
  { name: '/water/temperature_c', label: 'temperature', unit: '°C', step: 0.1 },
  { name: '/water/salinity_psu', label: 'salinity', unit: 'psu', step: 0.1 },
  { name: '/water/sound_speed_mps', label: 'sound speed', unit: 'm/s', step: 0.1, zero: 'computed' },
];

function numberRow(setting, name, steering) {
  const id = `set${name.replace(/\W/g, '-')}`;
  const input = make('input', { id, type: 'number', step: setting.step, required: !setting.zero, placeholder: setting.zero ?? '' });
  input.name = name;
  input.onchange = () => (input.value === '' && !setting.zero ? input.dispatchEvent(new Event('blur')) : steering.set(name, Number(input.value)));
  let before = '';
  input.onfocus = () => (before = input.value);
  // Returns nothing, because `false` would block all other keys of the field, even Tab.
  input.onkeydown = (event) => {
    if (event.key !== 'Escape') return;
    input.value = before;
    input.blur();
  };
  return make('div', { class: 'setting' }, make('label', { htmlFor: id }, setting.label), make('span', {}, input, ' ', make('span', { class: 'unit' }, setting.unit)));
}

function choiceRow(label, name, choices, steering) {
  const id = `set${name.replace(/\W/g, '-')}`;
  const select = make('select', { id, onchange: () => steering.set(name, choices.find((c) => String(c.value) === select.value).value) });
  select.name = name;
  select.append(...choices.map((c) => make('option', { value: String(c.value) }, c.text)));
  return make('div', { class: 'setting' }, make('label', { htmlFor: id }, label), select);
}

/// Older daemons do not name the modes.
function modesOf(facts) {
  const names = facts.info?.metadata?.[`sonard.modes.${facts.sonar}`]?.split('\n') ?? ['LF', 'HF'];
  return names.map((name, value) => ({ value, text: { LF: 'low frequency', HF: 'high frequency' }[name] ?? name }));
}

function rowsOf(facts, steering) {
  const of = (name) => `/${facts.sonar}/${name}`;
  const atMost = facts.sonarStatus?.on_request;
  const rows = numbers.filter((s) => facts.parameters.has(of(s.name))).map((s) => numberRow(s.name === 'rate_hz' && atMost ? { ...s, label: 'rate, at most' } : s, of(s.name), steering));
  rows.splice(facts.parameters.has(of('rate_hz')) ? 2 : 1, 0, plainRow('rate, measured', make('b', { id: 'measured' })));
  const yesNo = [{ value: true, text: 'on' }, { value: false, text: 'off' }];
  if (facts.of('mode') !== undefined) rows.push(choiceRow('mode', of('mode'), modesOf(facts), steering));
  if ([256, 512].includes(facts.of('beams'))) rows.push(choiceRow('beams', of('beams'), [256, 512].map((n) => ({ value: n, text: String(n) })), steering));
  if (facts.parameters.has(of('transmit'))) rows.push(choiceRow('transmit', of('transmit'), yesNo, steering));
  rows.push(...water.filter((s) => facts.parameters.has(s.name)).map((s) => numberRow(s, s.name, steering)));
  return rows;
}

const plainRow = (label, value) => make('div', { class: 'setting' }, make('span', {}, label), value);

/// Makes the rows if there are no parameters (an older daemon, or none yet): read-only values of the status.
function plainRows(sonar) {
  const rows = [['range', `${short(sonar?.range_m)} m`], ['rate', `${short(sonar?.rate_hz)} Hz`], ['gain', `${fixed(sonar?.gain_db, 0)} dB`]];
  return rows.map(([label, text]) => plainRow(label, make('b', {}, sonar ? text : dash)));
}

export function drawSettings(facts, steering) {
  const box = $('setting-rows');
  const names = [...facts.parameters.keys()].filter((n) => n.startsWith(`/${facts.sonar}/`) || n.startsWith('/water/'));
  const able = facts.maySteer && facts.connection === 'open';
  showList(box, [facts.sonar, names, Boolean(facts.sonarStatus?.on_request), names.length ? '' : facts.sonarStatus?.range_m], () => {
    return names.length ? rowsOf(facts, steering) : plainRows(facts.sonarStatus);
  });
  if ($('measured')) setText($('measured'), facts.recording ? dash : `${fixed(facts.madeRate, 1)} ${facts.rateUnit}`);
  for (const field of box.querySelectorAll('input, select')) {
    field.disabled = !able;
    field.title = able ? '' : 'this page is read-only';
    const value = facts.value(field.name);
    const text = value === 0 && field.placeholder ? '' : typeof value === 'number' ? short(value, 2) : String(value ?? '');
    if (document.activeElement !== field && field.value !== text) field.value = text;
  }
  const { asker } = facts;
  setText($('asked-by'), asker ? `last changed by ${asker}` : '');
  $('asked-by').title = asker ? facts.sonarStatus.asked_by : '';
}
