// The panel of faults: the active ones with their countdowns, and a button for each trouble.
import { $, make, setHidden, setText, showList } from '../dom.js';
import { countdown } from '../numbers.js';

/// "thin_tether" and "thin-tether" -> "Thin tether".
export const titleOf = (trouble) => trouble.replace(/[-_]/g, ' ').replace(/^./, (c) => c.toUpperCase());
/// Returns the requested fault: a trouble or a single kind. The kinds of a trouble are separate faults with the same `do`.
export const troubleOf = (fault) => fault.do || fault.name;

/// Returns the faults that are active or waiting, one entry per trouble and sonar: {trouble, sonar, names, ends_ns, by}.
export function activeTroubles(facts) {
  const groups = new Map();
  for (const fault of facts.faults) {
    const key = `${troubleOf(fault)} ${fault.sonar}`;
    const group = groups.get(key) ?? { trouble: troubleOf(fault), sonar: fault.sonar, names: [], ends_ns: 0, by: fault.by ?? '', waiting: true };
    group.names.push(fault.name);
    if (fault.state === 'active') group.ends_ns = Math.max(group.ends_ns, fault.ends_ns);
    else group.waits_for ||= fault.waits_for;
    group.waiting &&= fault.state === 'waiting';
    groups.set(key, group);
  }
  return [...groups.values()];
}

/// Returns the parameters /faults/TROUBLE, or /faults/SONAR/TROUBLE: {name, trouble, sonar}.
function offered(facts) {
  const out = [];
  for (const name of facts.parameters.keys()) {
    const parts = name.split('/').slice(1);
    if (parts[0] !== 'faults' || ['armed', 'clear_all'].includes(parts.at(-1))) continue;
    const sonar = parts.length > 2 ? parts[1] : '';
    if (!sonar || sonar === facts.sonar) out.push({ name, trouble: parts.at(-1), sonar });
  }
  return out;
}

const wholes = new Map();  // {ends_ns, whole_s} of each trouble, for its bar; the end differs by up to a second between messages

function card(group, about) {
  return make(
    'li',
    { class: 'fault-card' },
    make('div', {}, make('b', {}, titleOf(group.trouble)), make('span', { class: 'left' })),
    about && make('div', {}, about.sentence),
    about?.stays && make('div', { class: 'dim' }, `At its end it does not put back ${about.stays}.`),
    make('div', { class: 'dim' }, [group.sonar || 'every sonar', group.by && `requested by ${group.by}`].filter(Boolean).join(' · ')),
    make('progress', { max: 1, 'aria-label': 'time left' }),
  );
}

const aboutOf = (trouble, facts) => facts.troubles.get(trouble.replace(/_/g, '-'));
/// Returns the reason why the trouble cannot act on the sonar; undefined if it can.
const whyNot = (trouble, facts) => aboutOf(trouble, facts)?.cannot_act.find((entry) => entry.key === facts.sonar)?.value;

/// Makes a button that begins a trouble, with its description or the reason why it cannot act.
function button({ name, trouble }, facts, able, steering) {
  const about = aboutOf(trouble, facts);
  const cannot = whyNot(trouble, facts);
  const notes = [
    about?.sentence,
    cannot ? `Cannot act here: the sonar ${cannot}.` : about?.waits_for && `Begins with ${about.waits_for}.`,
    about?.own_s && !cannot ? `Lasts ${about.own_s} s.` : '',
    about?.stays && !cannot ? `Does not put back ${about.stays}.` : '',
  ];
  return make(
    'button',
    { 'data-trouble': trouble, onclick: () => steering.start(name, $('fault-seconds').value), disabled: !able || Boolean(cannot), title: able ? '' : 'this page is read-only' },
    make('b', {}, titleOf(trouble)),
    make('small', {}, notes.filter(Boolean).join(' ')),
  );
}

export function drawFaults(facts, steering) {
  const armed = facts.armed ?? facts.value('/faults/armed') ?? facts.status?.faults_armed;
  setText($('armed'), armed === undefined ? '–' : !armed ? 'not armed' : facts.maySteer ? 'armed' : 'read-only');
  const groups = activeTroubles(facts);
  const list = $('active-faults');
  showList(list, groups.map((g) => [g.trouble, g.sonar, g.by, facts.troubles.size]), () => groups.map((g) => card(g, facts.troubles.get(g.trouble))));
  groups.forEach((group, i) => {
    const left_s = group.ends_ns && facts.time_ns !== null ? (group.ends_ns - facts.time_ns) / 1e9 : NaN;
    const key = `${group.trouble} ${group.sonar}`;
    if (!Number.isNaN(left_s) && !(Math.abs(wholes.get(key)?.ends_ns - group.ends_ns) < 1e9)) wholes.set(key, { ends_ns: group.ends_ns, whole_s: left_s });
    const waits = group.waits_for ? `waits for ${group.waits_for}` : 'waits';
    setText(list.children[i].querySelector('.left'), group.waiting ? waits : Number.isNaN(left_s) ? 'acts' : countdown(left_s));
    const bar = list.children[i].querySelector('progress');
    setHidden(bar, Number.isNaN(left_s));
    bar.value = Number.isNaN(left_s) ? 0 : Math.max(0, Math.min(1, left_s / wholes.get(key).whole_s));
  });

  const troubles = armed ? offered(facts) : [];
  troubles.sort((a, b) => Boolean(whyNot(a.trouble, facts)) - Boolean(whyNot(b.trouble, facts)));  // those that can act come first
  const able = facts.maySteer && facts.connection === 'open';
  showList($('troubles'), [troubles, able, armed, [...facts.troubles.values()]], () => {
    if (armed === undefined) return [];
    if (!armed) return [make('p', { class: 'dim' }, 'To begin faults from here, start sonard with --faults.')];
    return troubles.map((offer) => button(offer, facts, able, steering));
  });
  $('troubles').classList.toggle('single', !armed);
  setHidden($('fault-row'), !armed);
  $('clear-faults').disabled = !able || groups.length === 0;
  $('fan-pane').classList.toggle('faulty', groups.some((g) => !g.sonar || g.sonar === facts.sonar));
}
