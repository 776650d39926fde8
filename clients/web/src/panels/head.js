// The line at the top: the sonar, its pings, problems, and the time.
import { $, make, setClass, setHidden, setText, showList } from '../dom.js';
import { dash, fixed, frequency } from '../numbers.js';

function rateOf(facts) {
  const sonar = facts.sonarStatus;
  if (facts.connection === 'open' && facts.recordingFailure) return { word: 'no recording', dot: 'error', rate: '' };
  if (facts.connection !== 'open' || !sonar) return { word: { lost: 'lost', token: 'token wanted' }[facts.connection] ?? 'connecting', dot: 'error', rate: dash };
  if (facts.recording) return { word: 'recording', dot: 'note', rate: '' };
  const measured = (rate) => (rate === undefined ? dash : `${fixed(rate, 1)} ${facts.rateUnit}`);
  if (facts.preview) return { word: 'preview', dot: 'note', rate: measured(facts.madeRate) };
  if (!facts.listened) return { word: 'no driver', dot: 'warning', rate: '' };
  if (sonar.rate_hz === 0) return { word: 'standby', dot: 'warning', rate: '' };
  if (!sonar.pinging) return { word: 'silent', dot: 'warning', rate: dash };
  return { word: 'pinging', dot: facts.isSlow ? 'warning' : 'ok', rate: measured(facts.madeRate) };
}

/// Returns the trade name of a product. Older daemons send only the name in a configuration.
const product = (facts, profile) => facts.info?.metadata?.[`sonard.product.${profile}`] ?? profile;

/// Returns the time in UTC, or a dash for files without times.
const recordedTime = (ns) => (ns > 1e17 ? new Date(ns / 1e6).toISOString().slice(0, 19).replace('T', ' ') : dash);

export function drawHead(facts) {
  const sonars = facts.status?.sonars ?? [];
  const select = $('sonar');
  showList(select, sonars.map((s) => [s.name, product(facts, s.profile)]), () =>
    sonars.map((s) => make('option', { value: s.name }, [s.name, product(facts, s.profile)].filter(Boolean).join(' · '))));
  if (select.value !== facts.sonar) select.value = facts.sonar;
  setHidden(select, sonars.length === 0);
  const { word, dot, rate } = rateOf(facts);
  setText($('rate-word'), word);
  setClass($('rate-word'), rate === '' || rate === dash ? '' : 'wide');  // narrow screens show one of the two
  setClass($('rate-dot'), `dot ${dot}`);
  setText($('rate'), rate);
  const sonar = facts.sonarStatus;
  setHidden($('frequency-chip'), !sonar?.frequency_hz);  // some recordings do not state it
  setText($('frequency'), frequency(sonar?.frequency_hz));
  const latency = facts.listened ? sonar?.figures?.latency_ms_p50 : 0;  // without a driver, it would be that of the last driver
  setText($('latency'), latency > 0 ? `${fixed(latency, 0)} ms` : dash);
  const faults = new Set(facts.faults.map((f) => f.do + f.sonar)).size;
  setHidden($('chip-faults'), faults === 0);
  setText($('fault-count'), String(faults));
  setHidden($('tab-faults'), faults === 0);  // phones have no space for the count at the top
  setText($('tab-faults'), String(faults));
  setText($('fault-word'), faults === 1 ? 'fault' : 'faults');
  setHidden($('chip-look'), facts.connection !== 'open' || facts.maySteer);
  setHidden($('live'), !facts.recording || !location.search.includes('recording='));
  setText($('clock'), facts.recording ? recordedTime(facts.now_ns) : facts.realtime || facts.now_ns === null ? facts.clock ?? dash : `${facts.clock} ${fixed(facts.now_ns / 1e9, 1)} s`);
  setText($('scene-name'), facts.status?.scene.replace(/^.*\//, '') || dash);
  const name = [facts.recording || facts.sonar, 'sonard', location.host].filter(Boolean).join(' · ');
  if (document.title !== name) document.title = name;
}
