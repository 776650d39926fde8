// Checks a running sonard: node judge.mjs CHECK URL; or a schema file: node judge.mjs schemas FILE.proto. Conditions are asserted
// here; values that foxglove_judge_test.py compares are printed as JSON.
import assert from 'node:assert/strict';
import { createHash } from 'node:crypto';
import { validateBytes } from 'gltf-validator';
import { compare, foxgloveTypes, typesOfFile } from './schemas.mjs';
import { Viewer, names, typesOf } from './viewer.mjs';

const sensible = (number) => assert(Number.isFinite(number) && Math.abs(number) < 1e12, `${number}`);
const stampOf = ({ seconds, nanos }) => seconds * 1_000_000_000n + BigInt(nanos);
const pause = (s) => new Promise((resolve) => setTimeout(resolve, 1000 * s));

// Both subprotocols, in both orders, and neither.
async function subprotocols(url) {
  for (const offered of [[names[0]], [names[1]], names, [...names].reverse()]) {
    const viewer = await new Viewer(url, offered).greeted();
    assert.equal(viewer.socket.protocol, offered[0]);
    assert.deepEqual(viewer.received.slice(0, 3).map((one) => one.kind), ['open', 'serverInfo', 'advertise']);
    await viewer.close();
  }
  const refused = await new Viewer(url, ['other.v1']).first('error');
  assert.match(refused.message, /400/);
}

const meaning = {
  'foxglove.RawImage'(image, ns) {
    const width = { mono8: 1, mono16: 2, '32FC1': 4 }[image.encoding];
    assert.equal(image.step, image.width * width);
    assert.equal(image.data.length, image.step * image.height);
    assert.equal(stampOf(image.timestamp), ns);
  },
  'foxglove.PointCloud'(cloud, ns) {
    assert.equal(cloud.data.length % cloud.point_stride, 0);
    for (const field of cloud.fields) assert(field.offset < cloud.point_stride);
    assert.deepEqual(cloud.fields.map((field) => field.name).slice(0, 3), ['x', 'y', 'z']);
    assert.equal(stampOf(cloud.timestamp), ns);
  },
  'foxglove.FrameTransforms'({ transforms }) {
    const parents = new Map(transforms.map((one) => [one.child_frame_id, one.parent_frame_id]));
    assert.deepEqual([parents.get('front'), parents.get('rov')], ['rov', 'world']);
    for (const { rotation: { x, y, z, w } } of transforms) assert(Math.abs(Math.hypot(x, y, z, w) - 1) < 1e-9);
  },
  async 'foxglove.SceneUpdate'({ entities }) {
    for (const { models, lines } of entities) {
      for (const { data, media_type } of models) {
        assert.equal(media_type, 'model/gltf-binary');
        const { issues: { numErrors, numWarnings, messages } } = await validateBytes(new Uint8Array(data), { format: 'glb' });
        assert.deepEqual([numErrors, numWarnings], [0, 0], JSON.stringify(messages));
      }
      for (const { points } of lines) assert(points.length > 1);
      assert(models.length + lines.length > 0);
    }
  },
  'foxglove.Log'({ message, level }) {
    assert(message.length > 0 && level >= 1 && level <= 5);
  },
  'sonar.v1.PingGeometry'({ azimuth_rad, row_spacing_m }) {
    assert(row_spacing_m > 0 && azimuth_rad.length > 1 && azimuth_rad[0] > 0 && azimuth_rad.at(-1) < 0);
  },
};

// Every advertised channel is read with its own schema. The pictures are printed with their ping numbers, for a comparison with
// those of a TCP client.
async function channels(url) {
  const viewer = await new Viewer(url).greeted();
  assert(!viewer.all('serverInfo')[0].capabilities.includes('time'));
  const forPlotJuggler = (one) => one.encoding === 'cdr' && one.schemaEncoding === 'ros2msg' && one.schema;
  assert([...viewer.channels.values()].some(forPlotJuggler), 'no channel that PlotJuggler would take');
  const theirs = foxgloveTypes();
  for (const { schemaName, schema } of viewer.channels.values()) {
    if (schemaName.startsWith('foxglove.')) assert.deepEqual(compare(typesOf(schema).resolveAll(), theirs).differences, []);
  }
  const topics = [...viewer.channels.keys()];
  viewer.subscribe(...topics);
  const messages = new Map(topics.map((topic) => [topic, []]));
  const missing = () => topics.filter((topic) => messages.get(topic).length < (topic === '/front/image' ? 15 : 1));
  for await (const { kind, value } of viewer.coming({ patience_s: 200, missing })) {
    if (kind !== 'message') continue;
    const { topic, timestamp: ns } = value;
    const content = viewer.decode(value);
    await meaning[viewer.channels.get(topic).schemaName]?.(content, ns);
    messages.get(topic).push({ ns, content });
    if (missing().length === 0) break;
  }
  const numbers = new Map(messages.get('/front/ping').map(({ ns, content }) => [ns, content.number]));
  for (const { ns, content } of messages.get('/front/ping')) assert.equal(content.fired_at_ns, ns);
  for (const { ns, content } of messages.get('/front/figures')) {
    Object.values(content).forEach(sensible);
    if (numbers.has(ns)) assert.equal(content.number, numbers.get(ns));
    assert(Math.abs(content.stamp_s - Number(ns) / 1e9) < 1e-3);
    assert.deepEqual([content.range_m, content.rate_hz, content.clients], [10, 10, 1]);
  }
  // After the answer to a request that was sent after `unsubscribe`, no message of that channel may arrive.
  const [subscription] = [...viewer.topics].find(([, topic]) => topic === '/front/image');
  viewer.client.unsubscribe(subscription);
  await viewer.parameters('/front/range_m');
  const silentFrom = viewer.received.length;
  await viewer.first('message', ({ topic }) => topic === '/front/ping', { from: silentFrom });
  await pause(0.5);
  assert(!viewer.received.slice(silentFrom).some(({ kind, value }) => kind === 'message' && value.topic === '/front/image'));
  assert.deepEqual(viewer.all('time'), []);
  await viewer.close();
  const sum = (data) => createHash('sha256').update(data).digest('hex');
  return {
    topics,
    images: messages.get('/front/image').map(({ ns, content }) => [numbers.get(ns), sum(content.data)]),
    counts: Object.fromEntries(topics.map((topic) => [topic, messages.get(topic).length])),
  };
}

// Parameters: list, write, refusals, updates, and unsupported requests; none of them ends the connection.
async function parameters(url) {
  const viewer = await new Viewer(url).greeted();
  const other = await new Viewer(url).greeted();
  const all = await viewer.parameters();
  for (const name of ['/front/range_m', '/front/transmit', '/water/temperature_c', '/faults/armed', '/clock/mode']) assert(name in all, name);
  for (const { name, value, type } of viewer.all('parameterValues')[0].parameters) {
    assert(value !== undefined, name);
    if (typeof value === 'number' && !Number.isInteger(value)) assert.equal(type, 'float64', name);  // otherwise it is an integer
  }
  other.client.subscribeParameterUpdates([]);
  assert.deepEqual(await viewer.set('/front/range_m', 7.5), { '/front/range_m': 7.5 });
  await other.first('parameterValues', (word) => word.parameters.some(({ name, value }) => name === '/front/range_m' && value === 7.5));

  const refusals = [['/front/range_m', 5000, 7.5], ['/front/range_m', 'far', 7.5], ['/front/range_m', undefined, 7.5],
    ['/front/transmit', 1, true], ['/front/beams', 1.5, all['/front/beams']], ['/clock/mode', 'stepped', 'realtime']];
  for (const [name, value, holds] of refusals) {
    const from = viewer.received.length;
    assert.deepEqual(await viewer.set(name, value), { [name]: holds });
    const status = await viewer.first('status', undefined, { from });
    assert.deepEqual([status.level, status.id], [2, `param:${name}`]);
    assert(status.message.length > 10);
  }
  await viewer.first('removeStatus', ({ statusIds }) => statusIds.includes('param:/front/range_m'));
  assert.deepEqual(await viewer.set('/front/nothing', 1), {});

  other.client.unsubscribeParameterUpdates([]);
  await other.parameters('/front/range_m');
  const from = other.received.length;
  await viewer.set('/front/range_m', 10);
  await pause(1.5);
  assert(!other.received.slice(from).some((one) => one.kind === 'parameterValues'), 'an update of what nothing is subscribed to');

  const cannot = [
    ['clientPublish', () => viewer.client.advertise({ topic: '/mine', encoding: 'json', schemaName: '' })],
    ['clientPublish', () => viewer.client.sendMessage(1, Buffer.from('{}'))],
    ['connectionGraph', () => viewer.client.subscribeConnectionGraph()],
    ['assets', () => viewer.client.fetchAsset('package://a.urdf', 1)],
  ];
  for (const [capability, ask] of cannot) {
    const before = viewer.received.length;
    ask();
    const { level, message } = await viewer.first('status', undefined, { from: before });
    assert.equal(level, 2);
    assert(message.includes(capability), message);
  }
  viewer.client.subscribe(9999);
  await viewer.first('status', ({ message }) => message.includes('9999'));
  assert.equal((await viewer.parameters('/front/range_m'))['/front/range_m'], 10);
  await Promise.all([viewer.close(), other.close()]);
}

// Services on a daemon in lockstep: time advances only with steps, and viewers receive each new time.
async function services(url) {
  const viewer = await new Viewer(url).greeted();
  assert(viewer.all('serverInfo')[0].capabilities.includes('time'));
  const start = (await viewer.first('time')).timestamp;
  for (const { name, type, request, response } of viewer.services.values()) {
    assert(name.startsWith('/sonard/') && type.startsWith('sonar.v1.'), name);
    for (const { encoding, schemaName, schemaEncoding, schema } of [request, response]) {
      assert.deepEqual([encoding, schemaEncoding, JSON.parse(schema).type], ['json', 'jsonschema', 'object']);
      assert(schemaName.length > 0);
    }
  }
  let now = start;
  for (const [call, dt_s] of [[41, 0.25], [42, 1.5]]) {
    viewer.call('/sonard/step', call, JSON.stringify({ dt_s }));
    now += BigInt(Math.round(dt_s * 1e9));
    assert.equal(BigInt((await viewer.answer(call)).now_ns), now);
    await viewer.first('time', ({ timestamp }) => timestamp === now);
  }
  viewer.client.subscribeParameterUpdates(['/front/range_m']);
  viewer.call('/sonard/set_sonar', 43, '{"range_m": 5}');
  await viewer.answer(43);
  await viewer.first('parameterValues', ({ parameters: [one] }) => one.name === '/front/range_m' && one.value === 5);
  const wrong = [[44, '/sonard/set_sonar', '{"range_m": -1}'], [45, '/sonard/step', 'nonsense'], [46, '/sonard/step', '{"no": 1}']];
  for (const [call, name, text] of wrong) {
    viewer.call(name, call, text);
    const { serviceId, message } = await viewer.first('serviceCallFailure', ({ callId }) => callId === call);
    assert.equal(serviceId, viewer.services.get(name).id);
    assert(message.length > 10);
  }
  viewer.client.sendServiceCallRequest({ serviceId: 9999, callId: 47, encoding: 'json', data: Buffer.from('{}') });
  await viewer.first('serviceCallFailure', ({ callId }) => callId === 47);
  const times = viewer.all('time').map(({ timestamp }) => timestamp);
  assert.equal(times.at(-1), now);
  await viewer.close();
  return { times: times.map(Number) };
}

// Stepped time, while a driver receives pings: viewers receive the times in order, at most 30 a second, and the last one.
async function stepped(url) {
  const viewer = await new Viewer(url).greeted();
  viewer.subscribe('/front/image');
  const begin = performance.now();
  const { timestamp: last } = await viewer.first('message', ({ timestamp }) => timestamp >= 2_000_000_000n);
  await viewer.first('time', ({ timestamp }) => timestamp >= last);
  const lasted_s = (performance.now() - begin) / 1000;
  const times = viewer.all('time').map(({ timestamp }) => timestamp);
  times.forEach((now, i) => assert(i === 0 || now >= times[i - 1], `${times[i - 1]} then ${now}`));
  assert(times.length <= 2 + 31 * (1 + lasted_s), `${times.length} in ${lasted_s} s`);
  await viewer.close();
  return { times: times.length };
}

// A viewer that stops reading until a picture is dropped, and 4 s more, gets a message, then the newest picture instead of those that waited.
async function stalled(url) {
  const viewer = await new Viewer(url).greeted();
  viewer.subscribe('/front/image');
  await viewer.first('message');
  viewer.socket.pause();
  const dropped = /sonard_viewer_dropped_total\{[^}]*channel="\/front\/image"\} [1-9]/;
  const deadline = performance.now() + 300_000;
  while (!dropped.test(await (await fetch(`${url.replace('ws', 'http')}metrics`)).text())) {
    assert(performance.now() < deadline, 'no picture was dropped in 300 s');
    await pause(0.2);
  }
  await pause(4);
  const from = viewer.received.length;
  const now = BigInt(Date.now()) * 1_000_000n;
  viewer.socket.resume();
  await viewer.first('message', ({ timestamp }) => timestamp > now, { from });
  const { level, id } = await viewer.first('status', ({ message }) => message === 'Send buffer limit reached');
  assert.deepEqual([level, id], [1, 'slow']);
  const stamps = viewer.all('message').map(({ timestamp }) => timestamp);
  stamps.forEach((stamp, i) => assert(i === 0 || stamp > stamps[i - 1], `${stamps[i - 1]} then ${stamp}`));
  const [gap, next] = stamps.slice(1).map((stamp, i) => [stamp - stamps[i], stamp]).sort(([a], [b]) => Number(b - a))[0];
  assert(gap > 3_000_000_000n, `the largest gap is ${gap} ns`);
  assert(next > now - 5_000_000_000n, `the first picture after the gap is ${now - next} ns old`);
  await viewer.first('removeStatus', ({ statusIds }) => statusIds.includes(id), { from });
  await viewer.close();
  return { gap_s: Number(gap) / 1e9 };
}

function schemas(file) {
  const { differences, fields } = compare(typesOfFile(file), foxgloveTypes());
  assert.deepEqual(differences, []);
  return { fields };
}

const [what, where] = process.argv.slice(2);
const judges = { channels, parameters, schemas, services, stalled, stepped, subprotocols };
console.log(JSON.stringify((await judges[what](where)) ?? {}));
process.exit(0);  // a failure would have thrown before; sockets may still be open
