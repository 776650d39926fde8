// The page's copy of the daemon's state: messages change it, panels read it. It draws nothing.
import { Counter, Counters } from './rates.js';

const log_lines = 500;
const replayed_lines = 100;  // limit of the repeated lines of a new connection; the daemon's lines_kept
const recent_pings = 1024;  // about 2 s of the fastest sonar
const history_s = 60;
const preview_stalls_s = 3;  // time without a preview after which the rate of previews is 0

const now_s = () => performance.now() / 1000;
const sameLine = (a, b) => a.ns === b.ns && a.message === b.message && a.name === b.name && a.level === b.level;
const beginsWith = (lines, beginning) => beginning.every((line, i) => sameLine(line, lines[i]));

/// A new connection repeats the last lines of the log, then sends new ones. Returns the new lines of `came`: all lines after the
/// longest beginning that equals an end of `known`. Returns null while that is undecided.
function linesAfter(known, came) {
  const last = known.slice(-replayed_lines);
  for (let at = 0; at < last.length; at++) {
    const end = last.slice(at);
    if (end.length > came.length && beginsWith(end, came)) return null;
    if (end.length <= came.length && beginsWith(came, end)) return came.slice(end.length);
  }
  return came;
}

export class Facts {
  constructor() {
    this.parameters = new Map();
    this.log = [];
    this.logCount = 0;
    this.replayed = null;  // lines of a new connection until it is known which of them are new
    this.sonar = '';
    this.connection = 'connecting';  // connecting, open, lost, token
    this.clear();
  }

  /// Call it for a new session: it clears everything but the log.
  clear() {
    this.status = null;
    this.findings = null;
    this.faults = [];
    this.troubles = new Map();  // the description of each trouble, by name
    this.frames = new Map();  // child -> {parent, translation, rotation}
    this.ping = null;
    this.geometry = new Map();  // by sonar
    this.pictures = new Map();  // by sonar: what its /fan shows
    this.events = new Map();    // log time -> ping event
    this.clientPings = new Counters();
    this.clientBytes = new Counters();
    this.drawn = new Counter();
    this.numbered = new Counter();  // numbers of the pings, for the rate at which they are made
    this.drawnPings = 0;
    this.received = new Counter();
    this.receivedBytes = 0;
    this.missed = 0;
    this.lastNumber = Infinity;  // number of the previous ping
    this.history = [];  // {time_s, made, rate} of the sonar's pings in the last minute
    this.droppedAt = new Map();  // client -> time (now_s) of the last increase of its drops
    this.drops = new Map();
    this.movedAt = now_s();  // time of the last change of the daemon's time
    this.now_ns = null;
    this.now_at = now_s();
  }

  opened(info) {
    const same = this.info?.sessionId === info.sessionId;
    const daemonOf = (one) => one?.sessionId.split('-')[0];  // the rest is the number of the session
    if (this.connection !== 'open') this.replayed = daemonOf(this.info) === daemonOf(info) ? [] : null;
    this.info = info;
    this.connection = 'open';
    const meta = info.metadata ?? {};
    this.maySteer = meta['sonard.may_steer'] !== 'false';
    this.clock = meta['sonard.clock'] ?? 'realtime';
    if (!same) this.clear();
    this.previews = meta['sonard.previews'] === 'true';  // the daemon previews by itself, without a driver
    this.recording = meta['sonard.recording'] ?? '';  // the file that is played; empty = live sonars are shown
    this.recordingFailure = meta['sonard.recording_failure'] ?? '';
    this.openedAt = now_s();
    this.parameters.clear();
  }

  get realtime() {
    return this.clock === 'realtime';
  }
  get sonarStatus() {
    return this.status?.sonars.find((s) => s.name === this.sonar) ?? null;
  }
  /// The page or driver that changed the settings last: "a page", or the address of a driver; '' if there is none.
  get asker() {
    const by = this.sonarStatus?.asked_by ?? '';
    return by.startsWith('live view ') ? 'a page' : by;
  }
  /// True if a driver is connected or a group of receivers gets the pings.
  get listened() {
    const sonar = this.sonarStatus;
    return Boolean(sonar && (sonar.clients.length > 0 || sonar.receivers?.length > 0));
  }
  /// The kind of picture, such as "fan". sonard draws pictures of many pings and of other shapes.
  get pictureKind() {
    return this.pictures.get(this.sonar)?.kind ?? 'fan';
  }
  get preview() {
    return !this.listened && Boolean(this.sonarStatus?.preview || this.of('preview'));
  }
  /// The expected rate of the sonar; 0 if its host requests each ping.
  get wantedRate() {
    const sonar = this.sonarStatus;
    return sonar?.on_request ? 0 : sonar?.rate_hz ?? 0;
  }
  /// True if a ping is one line of the picture.
  get linesByPing() {
    return ['sweep', 'waterfall'].includes(this.pictureKind);
  }
  /// The measured rate of the pings that the page shows. The rate of previews is computed from their numbers until the next
  /// status. Older daemons send no rate.
  get madeRate() {
    return this.preview ? this.previewRate : this.sonarStatus?.figures?.made_hz ?? this.rate;
  }
  get rateUnit() {
    return this.linesByPing ? 'lines/s' : 'Hz';
  }
  /// True if the engine is too slow: pings come at less than 90 % of the requested rate, and computing takes at least 30 % of
  /// the time. If the host requests each ping, no rate is expected.
  get isSlow() {
    const sonar = this.sonarStatus;
    const wanted = this.wantedRate;
    return Boolean(this.realtime && wanted > 0 && this.rate < 0.9 * wanted && this.rate * (sonar.figures?.simulation_ms ?? 0) > 300);
  }
  /// The vehicle that carries the sonar, according to the frames, or the only vehicle.
  get vehicle() {
    const name = this.frames.get(this.sonar)?.parent;
    const vehicles = this.status?.vehicles ?? [];
    return vehicles.find((v) => v.name === name) ?? (vehicles.length === 1 ? vehicles[0] : null);
  }
  /// The daemon's time; while it runs in real time, the page's clock continues it.
  get time_ns() {
    if (this.now_ns === null) return null;
    return this.realtime ? this.now_ns + (now_s() - this.now_at) * 1e9 : this.now_ns;
  }

  setTime(ns) {
    if (ns !== this.now_ns) this.movedAt = now_s();
    this.now_ns = ns;
    this.now_at = now_s();
  }

  setParameters(list) {
    for (const p of list) {
      if (p.value === undefined) this.parameters.delete(p.name);
      else this.parameters.set(p.name, p);
    }
  }
  value(name) {
    return this.parameters.get(name)?.value;
  }
  of(name) {
    return this.value(`/${this.sonar}/${name}`);
  }

  message(topic, value, ns) {
    switch (topic) {
      case '/status':
        return this.setStatus(value, ns);
      case '/doctor':
        this.findings = value.findings;
        this.checkedAt = now_s();
        return;
      case '/faults':
        this.faults = value.faults.filter((f) => f.state !== 'over').map((f) => ({ ...f, ends_ns: f.expires_s > 0 ? ns + f.expires_s * 1e9 : 0 }));
        this.armed = value.armed;
        this.troubles = new Map(value.troubles.map((t) => [t.name, t]));
        return;
      case '/log':
        this.addLine({ ...value, ns });
        return;
      case '/tf':
        for (const t of value.transforms) this.frames.set(t.child_frame_id, { parent: t.parent_frame_id, translation: t.translation, rotation: t.rotation });
        return;
    }
    const [, sonar, kind] = topic.split('/');
    if (kind === 'geometry') this.geometry.set(sonar, { ...value, ns });
    if (kind === 'ping' && sonar === this.sonar) this.pingEvent(value, ns);
    if (kind === 'picture') this.pictures.set(sonar, value);
    if ((kind === 'image' || kind === 'fan') && sonar === this.sonar) this.image(value, ns, kind === 'fan');
  }

  addLine(line) {
    const lines = this.replayed ? linesAfter(this.log, [...this.replayed, line]) : [line];
    if (!lines) return this.replayed.push(line);
    this.replayed = null;
    this.log.push(...lines);
    this.logCount += lines.length;
    this.log.splice(0, this.log.length - log_lines);
  }

  pingEvent(event, ns) {
    this.events.set(ns, event);
    this.numbered.add(now_s(), event.number);
    if (this.events.size > recent_pings) this.events.delete(this.events.keys().next().value);
    if (this.ping?.ns === ns) this.count(this.ping, event);
  }

  /// `drawn` is true for a picture that sonard has drawn, false for the ping's samples.
  image(image, ns, drawn) {
    const geometry = this.geometry.get(this.sonar);
    if (!geometry && !drawn) return;
    this.receivedBytes += image.data.length;
    this.received.add(now_s(), this.receivedBytes);
    this.ping = { image, geometry, ns, at: now_s(), about: drawn ? this.pictures.get(this.sonar) ?? {} : null };
    const event = this.events.get(ns) ?? (geometry?.ns === ns ? geometry : null);  // a new subscriber gets the last picture without its event
    if (event) this.count(this.ping, event);
  }

  /// A picture has no number, but the event of the same time has one. The event comes before or after the picture.
  count(ping, event) {
    ping.number = event.number;
    if (Boolean(event.preview) !== this.wasPreview) this.lastNumber = Infinity;  // previews have numbers of their own
    this.wasPreview = Boolean(event.preview);
    if (!ping.about && event.number > this.lastNumber + 1 && event.number - this.lastNumber < 1000) this.missed += event.number - this.lastNumber - 1;
    this.lastNumber = event.number;
  }

  pingDrawn() {
    this.drawn.add(now_s(), ++this.drawnPings);
  }

  setStatus(status, ns) {
    const before = this.vehicle;
    this.status = status;
    if (!this.vehicle?.stale) this.staleSince = undefined;
    else if (before && !before.stale) this.staleSince = now_s();  // unknown in a page that was opened later
    this.clock = status.clock || this.clock;
    this.setTime(status.now_ns || ns);
    if (!status.sonars.some((s) => s.name === this.sonar)) this.sonar = status.sonars[0]?.name ?? '';
    const time_s = this.realtime ? ns / 1e9 : now_s();
    const pings = new Map();
    const bytes = new Map();
    for (const sonar of status.sonars) {
      for (const client of sonar.clients) {
        const key = `${sonar.name} ${client.address}`;
        pings.set(key, client.pings_written);
        bytes.set(key, client.bytes_written);
        if (client.pings_dropped > (this.drops.get(key) ?? client.pings_dropped)) this.droppedAt.set(key, now_s());
        this.drops.set(key, client.pings_dropped);
      }
    }
    this.clientPings.update(time_s, pings);
    this.clientBytes.update(time_s, bytes);
    const made = this.sonarStatus?.figures?.pings;
    if (made !== undefined) {
      const last = this.history.at(-1);
      const rate = this.preview ? this.previewRate : last && made >= last.made && time_s > last.time_s ? (made - last.made) / (time_s - last.time_s) : undefined;
      if (!last || time_s - last.time_s > 0.5 || made < last.made) this.history.push({ time_s, made, rate });
      this.history = this.history.filter((h) => h.time_s > time_s - history_s && h.time_s <= time_s);
    }
  }

  /// The rate at which previews are made [Hz]; 0 if the page has received none for preview_stalls_s.
  get previewRate() {
    const last = this.numbered.readings.at(-1);
    return last && now_s() - last.time_s > preview_stalls_s ? 0 : this.numbered.rate;
  }

  /// The rate at which the sonar makes pings [Hz], over about two seconds; undefined if there are fewer than two readings.
  get rate() {
    const last = this.history.at(-1);
    const first = this.history.findLast((h) => h.time_s <= (last?.time_s ?? 0) - 1.9) ?? this.history[0];
    if (!last || !first || last === first) return undefined;
    return (last.made - first.made) / (last.time_s - first.time_s);
  }

  select(sonar) {
    if (sonar === this.sonar) return;
    this.sonar = sonar;
    this.ping = null;
    this.history = [];
    this.numbered = new Counter();
    this.lastNumber = Infinity;
    this.missed = 0;
  }
}
