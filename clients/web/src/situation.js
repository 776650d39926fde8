// Determines, from the facts, the text over the fan if the picture is missing, old or doubtful: one sentence and at most one
// button.
import { fixed, short } from './numbers.js';

const stands_after_s = 2;
const preview_begins_s = 5;  // a daemon that previews by itself (the demo) has this long before the page reports that no driver is connected
const now_s = () => performance.now() / 1000;

/// The first address at which the sonar waits for a driver, such as "udp 127.0.0.2:12345". Older daemons send only the host.
function whereToConnect(sonar) {
  const found = sonar.addresses?.find((a) => !a.sonar_speaks_first);
  return found ? `${found.protocol} ${found.address}` : host(sonar.listens) || sonar.advertised;
}

/// Returns an address without its port.
const host = (address) => address?.replace(/:\d+$/, '') ?? '';
const noted = (facts, check) => facts.findings?.find((f) => f.check === check && f.level !== 0)?.text;

function lost(facts, connection) {
  if (connection.lostAt === null) return 'Connecting to sonard.';
  const since = Math.round((performance.now() - connection.lostAt) / 1000);
  const next = Math.max(0, Math.ceil((connection.retryAt - performance.now()) / 1000));
  return `sonard has not answered for ${since} s; trying again in ${next} s. Does it still run?`;
}

function stands(facts) {
  const clock = facts.clock;
  if (clock === 'follow' && !facts.status.vehicles.some((v) => v.source))
    return { kind: 'no-pose-yet', picture: 'none', text: 'Waiting for the first pose: time follows the poses. Start the sender of the poses.' };
  if (facts.realtime || now_s() - facts.movedAt < stands_after_s) return null;
  const at = `Time stands still at ${fixed((facts.now_ns ?? 0) / 1e9, 3)} s`;
  const driverIsSlow = facts.findings?.some((f) => f.check === 'clock' && f.level === 2);  // a step would wait too
  const text = noted(facts, 'clock') ?? (clock === 'lockstep' ? `${at}: it moves when a step is requested, here or by sonarctl step.` : `${at}: it moves when every driver has received the last ping.`);
  const button = clock === 'lockstep' && !driverIsSlow ? { label: 'Step 0.1 s', service: '/sonard/step', request: { dt_s: 0.1 } } : undefined;
  return { kind: `${clock}-waits`, picture: 'dim', text, button };
}

/// Returns {kind, picture: 'as is' | 'dim' | 'old' | 'none', text, button?: {label, parameter, value | service, request}}, or
/// null if all is well.
export function situationOf(facts, connection) {
  if (facts.connection === 'token') return { kind: 'token', picture: 'none', text: `${facts.tokenRefused ? 'That token was refused. ' : ''}Enter the token of sonard: the text in the file that control.token_file names.` };
  if (facts.connection !== 'open') return { kind: 'lost', picture: 'old', text: lost(facts, connection) };
  if (facts.recording) {
    if (facts.recordingFailure) return { kind: 'no-recording', picture: 'none', text: facts.recordingFailure };
    return facts.vehicle ? null : { kind: 'reading', picture: 'none', text: `Reading ${facts.recording}.` };
  }
  const sonar = facts.sonarStatus;
  if (!sonar) return facts.status ? { kind: 'no-sonar', picture: 'none', text: 'This sonard has no sonar.' } : null;
  if (!facts.listened && !facts.preview) {
    if (facts.previews && now_s() - facts.openedAt < preview_begins_s) return null;
    return {
      kind: 'no-client',
      picture: 'old',
      text: `No driver is connected. Nothing is simulated without one. Point a driver at ${whereToConnect(sonar)}.`,
      button: facts.parameters.has(`/${sonar.name}/preview`) ? { label: 'Preview', parameter: `/${sonar.name}/preview`, value: true } : undefined,
    };
  }
  const standing = stands(facts);
  if (standing) return standing;
  if (sonar.rate_hz === 0 && sonar.clients.length > 0) {
    return {
      kind: 'standby',
      picture: 'dim',
      text: facts.asker ? `Standby: ${host(facts.asker)} set the rate to 0.` : 'Standby: no driver has requested pings yet.',
      button: facts.parameters.has(`/${sonar.name}/rate_hz`) && { label: 'Ask for 10 Hz', parameter: `/${sonar.name}/rate_hz`, value: 10 },
    };
  }
  return null;
}

/// Returns the short remarks above the picture: {text, level, title}.
export function badgesOf(facts) {
  const out = [];
  const sonar = facts.sonarStatus;
  if (facts.connection !== 'open' || !sonar) return out;
  const seen = facts.ping?.about;
  if (seen?.nothing_detected) out.push({ text: `nothing detected within ${short(seen.range_m)} m`, level: 'note', title: "the sonar's messages have no echo" });
  if (facts.recording) return [{ text: 'RECORDING', level: 'note', title: facts.recording }, ...out];
  if (facts.noScene) out.push({ text: 'no scene', level: 'note', title: facts.noScene });
  if (facts.preview) out.push({ text: 'PREVIEW', level: 'note', title: 'for viewers only; it ends when a driver connects' });
  if (!sonar.transmits) out.push({ text: 'transmit is off: noise only', level: 'warning', title: 'see the settings' });
  const vehicle = facts.vehicle;
  if (vehicle?.stale) {
    const since = facts.staleSince ? ` for ${fixed(now_s() - facts.staleSince, 1)} s` : ' since before this page opened';
    out.push({ text: `no pose${since}; ${vehicle.name} stays where it was`, level: 'warning', title: '' });
  }
  const wanted = facts.wantedRate;
  if (sonar.pinging && facts.isSlow && sonar.figures?.simulation_ms > 900 / wanted)
    out.push({ text: `${short(facts.madeRate, 1)} of ${short(wanted, 1)} ${facts.rateUnit}: computing takes ${short(sonar.figures.simulation_ms, 0)} ms`, level: 'warning', title: 'the engine is slower than the requested rate' });
  const age_s = facts.ping ? now_s() - facts.ping.at : 0;
  if (sonar.pinging && wanted > 0 && facts.ping && age_s > Math.max(1, 2 / wanted) && facts.realtime)
    out.push({ text: `picture is ${fixed(age_s, 1)} s old`, level: 'warning', title: '' });
  return out;
}
