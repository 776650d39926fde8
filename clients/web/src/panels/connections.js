// The connections, what each receives, and the rate of the last minute.
import { $, make, setClass, setText, showList } from '../dom.js';
import { dash, fixed, megabits, whole } from '../numbers.js';

const rising_s = 60;
const now_s = () => performance.now() / 1000;

const many = (count, word) => `${count} ${word}${count === 1 ? '' : 's'}`;

function rowsOf(facts) {
  const rows = [];
  const sonars = facts.status?.sonars ?? [];
  for (const sonar of sonars) {
    for (const client of sonar.clients) {
      const key = `${sonar.name} ${client.address}`;
      const rate = facts.clientPings.rate(key);
      const rising = now_s() - (facts.droppedAt.get(key) ?? -Infinity) < rising_s;
      const silent = rate === 0 && !client.commands_only;
      rows.push({
        key,
        who: client.address,
        title: (sonars.length > 1 ? `of ${sonar.name}` : `connected for ${fixed(client.connected_s, 0)} s`) + (client.commands_only ? ', for commands: it gets no pings' : ''),
        dot: silent || rising ? 'warning' : rate === undefined ? '' : 'ok',
        hz: client.commands_only ? dash : fixed(rate, 1),
        megabits: megabits(facts.clientBytes.rate(key) === undefined ? undefined : 8 * facts.clientBytes.rate(key)),
        dropped: client.commands_only ? dash : whole(client.pings_dropped),
        rising,
      });
    }
  }
  for (const sonar of sonars)
    for (const to of sonar.receivers ?? [])
      if (!sonar.clients.some((client) => client.address === to))
        rows.push({ key: `${sonar.name} ${to}`, who: to, title: 'receives the datagrams', dot: 'ok', hz: dash, megabits: dash, dropped: dash });
  const seen = facts.connection === 'open';
  const bytes = facts.received.rate;
  rows.push({
    key: 'this page',
    who: 'this page',
    title: 'pictures drawn; dropped: gaps in the numbers of the pings',
    dot: seen ? 'note' : '',
    hz: seen && facts.ping ? fixed(facts.drawn.rate, 1) : dash,
    megabits: seen && facts.ping ? megabits(8 * bytes) : dash,
    dropped: seen && facts.ping ? whole(facts.missed) : dash,
    self: true,
  });
  return rows;
}

export function drawConnections(facts) {
  const rows = rowsOf(facts);
  const drivers = (facts.status?.sonars ?? []).reduce((sum, sonar) => sum + sonar.clients.length, 0);
  const viewers = facts.status?.viewers?.length ?? 0;  // older daemons do not list viewers
  setText($('connection-count'), facts.status ? many(drivers, 'driver connection') + (viewers ? `, ${many(viewers, 'viewer')}` : '') : dash);
  const body = $('clients');
  showList(body, rows.map((r) => r.key), () =>
    rows.map(() => make('tr', {}, make('td', { class: 'who' }, make('span', { class: 'dot' }), make('span')), make('td'), make('td'), make('td'))));
  rows.forEach((row, i) => {
    const [who, hz, mbit, dropped] = body.children[i].children;
    setClass(body.children[i], row.self ? 'self' : '');
    setClass(who.firstChild, `dot ${row.dot}`);
    setText(who.lastChild, row.who);
    if (who.title !== row.title) who.title = row.title;
    setText(hz, row.hz);
    setText(mbit, row.megabits);
    setText(dropped, row.dropped + (row.rising ? ' !' : ''));
    setClass(dropped, row.rising ? 'rising' : '');
  });
  const addresses = facts.sonarStatus?.addresses ?? [];
  const wait = facts.listened ? '' : ' · waits for the driver';
  showList($('addresses'), [addresses, wait], () =>
    addresses.map((a) => make('li', { class: 'dim' }, `${a.protocol} `, make('b', {}, a.address), a.carries && ` · ${a.carries}`, a.sonar_speaks_first ? ' · sent without a request' : wait)));
}

/// Draws the rate of pings in the last minute, the newest on the right, if it has changed.
export function drawHistory(canvas, facts) {
  const ratio = Math.min(2, devicePixelRatio || 1);
  const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(34 * ratio)];
  const asked = facts.preview ? 0 : facts.wantedRate;  // previews have a rate of their own
  const shown = [width, height, facts.sonar, facts.history.at(-1)?.time_s, asked, document.documentElement.dataset.theme].join();
  if (width === 0 || canvas.shown === shown) return;
  canvas.shown = shown;
  if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
  const g = canvas.getContext('2d');
  g.clearRect(0, 0, width, height);
  const style = getComputedStyle(canvas);
  const points = facts.history.filter((h) => h.rate !== undefined);
  const top = Math.max(asked, ...points.map((p) => p.rate), 1) * 1.15;
  const y = (rate) => height - 2 - (rate / top) * (height - 4);
  g.fillStyle = style.getPropertyValue('--line');
  g.fillRect(0, height - ratio, width, ratio);
  if (asked > 0) {  // the requested rate, dashed
    g.strokeStyle = style.getPropertyValue('--line');
    g.setLineDash([4 * ratio, 4 * ratio]);
    g.beginPath();
    g.moveTo(0, y(asked));
    g.lineTo(width, y(asked));
    g.stroke();
    g.setLineDash([]);
  }
  if (points.length < 2) return;
  const newest = points.at(-1).time_s;
  g.strokeStyle = style.getPropertyValue('--accent');
  g.lineWidth = 1.5 * ratio;
  g.beginPath();
  points.forEach((p, i) => g[i ? 'lineTo' : 'moveTo'](width - ((newest - p.time_s) / 60) * width, y(p.rate)));
  g.stroke();
}
