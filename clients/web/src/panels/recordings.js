// Recordings of the sonar: one button, and a list of those that run or have ended, from the status.
import { $, make, setText, showList } from '../dom.js';
import { fixed, whole } from '../numbers.js';

const running = (facts) => facts.status?.recordings.find((r) => r.running && r.sonar === facts.sonar);

const nameOf = (recording) => recording.file.replace(/^.*\//, '');  // the name with which it was started

/// Returns the name of a new file, with the present time: "front-20261128-010203.mcap".
function newName(sonar) {
  const digits = new Date().toISOString().replace(/\D/g, '');
  return `${sonar}-${digits.slice(0, 8)}-${digits.slice(8, 14)}.mcap`;
}

/// Call it when the button is pressed; `call(service, request)` calls the service.
export function toggleRecording(facts, call) {
  const one = running(facts);
  if (one) call('/sonard/stop_recording', { file: nameOf(one) });
  else call('/sonard/start_recording', { file: newName(facts.sonar), sonar: facts.sonar });
}

/// True if a recording ended without pings. Of recordings from earlier runs, which have no sonar, only the size is known.
const isEmpty = (r) => !r.running && Boolean(r.sonar) && !r.pings;

function about(r, facts) {
  if (r.running && r.sonar === facts.sonar && !facts.listened) return 'waits for a driver, such as sonarctl listen: previews are not recorded';
  const size = `${fixed(r.bytes / 1e6, 1)} MB`;
  if (isEmpty(r)) return `${r.sonar} · no pings: nothing to play · ${r.why || 'ended'}`;
  return r.sonar ? `${r.sonar} · ${whole(r.pings)} pings · ${size} · ${r.running ? 'running' : r.why || 'ended'}` : size;
}

export function drawRecordings(facts) {
  const all = [...(facts.status?.recordings ?? [])].reverse();  // the newest first
  const one = running(facts);
  setText($('record'), one ? 'Stop recording' : 'Record');
  $('record').setAttribute('aria-pressed', String(Boolean(one)));
  $('record').disabled = !facts.maySteer || facts.connection !== 'open' || !facts.sonar;
  showList($('recordings'), [all, facts.sonar, facts.listened], () => all.map((r) => make('li', {}, r.running || isEmpty(r) ? make('b', { title: r.file }, nameOf(r)) : make('a', { href: `/?recording=${encodeURIComponent(nameOf(r))}`, title: `Play ${r.file}` }, `▶ ${nameOf(r)}`),
    make('small', {}, ` ${about(r, facts)}`))));
}
