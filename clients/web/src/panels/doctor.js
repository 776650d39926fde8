// "Why is my driver silent?": the daemon's findings, worst first, each with a remedy.
import { $, make, setHidden, setText, showList, sign } from '../dom.js';
import { dash } from '../numbers.js';
import { activeTroubles, titleOf, troubleOf } from './faults.js';

const levels = ['ok', 'warning', 'error'];
const now_s = () => performance.now() / 1000;

function item(finding, clear) {
  const level = levels[finding.level] ?? 'warning';
  return make(
    'li',
    { class: 'finding' },
    sign(level),
    make('span', {}, finding.text),
    finding.cure || clear ? make('small', {}, finding.cure ?? '', clear ? ' ' : '', clear) : null,
  );
}

/// Draws the findings. `steering.clear(fault)` ends a fault.
export function drawDoctor(facts, steering) {
  const findings = facts.connection === 'open' ? facts.findings : null;
  setText($('checked'), findings ? `${Math.max(0, Math.round(now_s() - facts.checkedAt))} s ago` : dash);
  const noted = (findings ?? []).filter((f) => f.level !== 0).sort((a, b) => b.level - a.level);
  const faults = facts.connection !== 'open' ? [] : activeTroubles(facts).filter((f) => !f.waiting).map((f) => (
    { level: 2, check: 'fault', text: `A fault acts on ${f.sonar || 'every sonar'}: ${titleOf(f.trouble)}.`, cure: f.ends_ns ? 'It ends by itself, or' : '' }));
  const bad = [...faults, ...noted.filter((f) => f.check !== 'fault')];  // faults first, named as on their buttons
  const well = (findings ?? []).filter((f) => f.level === 0);
  const active = facts.faults;
  const ofFault = (finding) => (finding.check === 'fault' ? active.find((f) => finding.text.includes(troubleOf(f)) || finding.text.includes(titleOf(troubleOf(f))) || finding.text.includes(f.name) || active.length === 1) : null);
  showList($('findings'), [bad, active.map((f) => f.name), facts.maySteer, findings === null, facts.judged, facts.connection], () => {
    if (facts.connection !== 'open') return [make('li', { class: 'dim' }, 'Not known now.')];
    if (bad.length === 0 && !findings) return [make('li', { class: 'dim' }, facts.judged ? 'Not checked yet.' : 'Run sonarctl doctor: it checks the daemon and the network.')];
    if (bad.length === 0) return [item({ level: 0, text: 'No problem was found for drivers.', cure: '' })];
    return bad.map((finding) => {
      const fault = ofFault(finding);
      const clear = fault && make('button', { class: 'link', onclick: () => steering.clear(fault), disabled: !facts.maySteer, title: facts.maySteer ? `ends ${titleOf(troubleOf(fault))}` : 'this page is read-only' }, 'Clear it');
      return item(finding, clear);
    });
  });
  setHidden($('well'), well.length === 0);
  setText($('well-count'), `${well.length} ${well.length === 1 ? 'check is' : 'checks are'} well`);
  showList($('well-list'), well, () => well.map((finding) => item({ ...finding, cure: '' })));
}
