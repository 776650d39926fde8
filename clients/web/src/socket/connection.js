// The page's connection: opens the socket again when it is lost, subscribes to the requested topics, and passes decoded messages on.
import { decode, readDescriptors } from './protobuf.js';
import { callFrame, readFrame } from './frames.js';

const waits_s = [1, 2, 4, 8];
const subprotocols = ['foxglove.sdk.v1', 'foxglove.websocket.v1'];

export class Connection {
  /// `on`: functions open(info), lost(), needsToken(), message(topic, value, ns), time(ns), parameters(list), status(status),
  /// topics().
  constructor(on) {
    this.on = on;
    this.tries = 0;
    this.lostAt = null;  // performance.now() of the loss; null = connected
    this.retryAt = 0;
    this.topics = new Set();  // topics to subscribe to
    this.forget();
  }

  forget() {
    this.channels = new Map();  // by id
    this.byTopic = new Map();
    this.subscriptions = new Map();  // id -> channel
    this.services = new Map();
    this.calls = new Map();
    this.nextId = 1;
  }

  get token() {
    return sessionStorage.getItem('sonard.token') ?? '';
  }
  useToken(token) {
    sessionStorage.setItem('sonard.token', token);
    this.open();
  }

  async open() {
    clearTimeout(this.timer);
    this.socket?.close();
    const attempt = (this.attempt = {});
    const query = new URLSearchParams();
    const recording = new URLSearchParams(location.search).get('recording');
    if (recording) query.set('recording', recording);
    try {
      if (this.token) query.set('ticket', await this.ticket());
    } catch (error) {
      if (error.message === 'token') return this.on.needsToken(true);
      return this.retry();
    }
    if (attempt !== this.attempt) return;
    const here = location.origin.replace(/^http/, 'ws');
    const socket = (this.socket = new WebSocket(`${here}/?${query}`, subprotocols));
    socket.binaryType = 'arraybuffer';
    socket.onmessage = ({ data }) => {
      if (socket !== this.socket) return;
      if (typeof data === 'string') this.word(JSON.parse(data));
      else this.frame(data);
    };
    socket.onclose = async () => {
      if (socket !== this.socket) return;
      if (this.lostAt === null || this.tries === 0) this.on.lost();
      this.lostAt ??= performance.now();
      if (!this.greeted && (await this.refused())) return this.on.needsToken(false);
      this.retry();
    };
    this.greeted = false;  // true once serverInfo has come
  }

  /// Returns whether the socket was refused because the token is missing. Browsers do not report that, so this sends a request.
  async refused() {
    try {
      return (await fetch('/api/v1/status', { headers: this.token ? { Authorization: `Bearer ${this.token}` } : {} })).status === 401;
    } catch {
      return false;
    }
  }

  async ticket() {
    const headers = { Authorization: `Bearer ${this.token}`, 'Content-Type': 'application/json' };
    const answer = await fetch('/api/v1/view_ticket', { method: 'POST', headers, body: '{}' });
    if (answer.status === 401) throw new Error('token');
    return (await answer.json()).ticket;
  }

  retry() {
    this.lostAt ??= performance.now();
    const wait_s = waits_s[Math.min(this.tries++, waits_s.length - 1)];
    this.retryAt = performance.now() + 1000 * wait_s;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.open(), 1000 * wait_s);
  }

  word(word) {
    switch (word.op) {
      case 'serverInfo':
        if (!this.greeted) this.forget();  // later messages of a connection do not change channels and subscriptions
        this.greeted = true;
        this.tries = 0;
        this.lostAt = null;
        this.on.open(word);
        this.send({ op: 'getParameters', parameterNames: [], id: 'all' });
        this.send({ op: 'subscribeParameterUpdates', parameterNames: [] });
        break;
      case 'advertise':
        for (const channel of word.channels) this.advertise(channel);
        this.on.topics();
        this.subscribe();
        break;
      case 'unadvertise':
        for (const id of word.channelIds) this.unadvertise(id);
        this.on.topics();
        break;
      case 'parameterValues':
        this.on.parameters(word.parameters);
        break;
      case 'status':
        this.on.status(word);
        break;
      case 'advertiseServices':
        for (const service of word.services) this.services.set(service.name, service.id);
        break;
      case 'serviceCallFailure':
        this.finishCall(word.callId, null, word.message);
        break;
    }
  }

  advertise(channel) {
    if (channel.encoding !== 'protobuf') return;
    this.channels.set(channel.id, channel);
    this.byTopic.set(channel.topic, channel);
  }

  unadvertise(id) {
    const channel = this.channels.get(id);
    if (!channel) return;
    this.channels.delete(id);
    this.byTopic.delete(channel.topic);
    for (const [subscription, of] of this.subscriptions) if (of === channel) this.subscriptions.delete(subscription);
  }

  /// Subscribes to these topics, and no others, as soon as they exist.
  want(topics) {
    this.topics = new Set(topics);
    this.subscribe();
  }

  subscribe() {
    const gone = [];
    const have = new Set();
    for (const [id, channel] of this.subscriptions) {
      if (this.topics.has(channel.topic)) have.add(channel.topic);
      else gone.push(id);
    }
    for (const id of gone) this.subscriptions.delete(id);
    const added = [];
    for (const topic of this.topics) {
      const channel = this.byTopic.get(topic);
      if (!channel || have.has(topic)) continue;
      added.push({ id: this.nextId, channelId: channel.id });
      this.subscriptions.set(this.nextId++, channel);
    }
    if (gone.length) this.send({ op: 'unsubscribe', subscriptionIds: gone });
    if (added.length) this.send({ op: 'subscribe', subscriptions: added });
  }

  frame(buffer) {
    const frame = readFrame(buffer);
    if (frame?.op === 'time') this.on.time(frame.ns);
    if (frame?.op === 'answer') this.finishCall(frame.call, frame.payload);
    if (frame?.op !== 'data') return;
    const channel = this.subscriptions.get(frame.subscription);
    if (!channel) return;
    // A channel's descriptors are parsed here, because most channels are never subscribed to.
    channel.types ??= readDescriptors(Uint8Array.from(atob(channel.schema), (c) => c.charCodeAt(0)));
    this.on.message(channel.topic, decode(channel.types, channel.schemaName, frame.payload), frame.ns);
  }

  finishCall(call, answer, refusal) {
    const waiting = this.calls.get(call);
    this.calls.delete(call);
    if (refusal === undefined) waiting?.done(answer);
    else waiting?.failed(new Error(refusal));
  }

  send(word) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(word));
  }
  /// `type`: "float64" for numbers that are not integers by nature; undefined for others.
  set(name, value, type) {
    this.send({ op: 'setParameters', parameters: [{ name, value, type }], id: name });
  }
  /// Calls a service and returns its answer as text; throws the daemon's sentence if it fails.
  call(service, request) {
    return new Promise((done, failed) => {
      const id = this.services.get(service);
      if (id === undefined) return failed(new Error(`sonard does not offer ${service}`));
      const call = this.nextId++;
      this.calls.set(call, { done, failed });
      this.socket.send(callFrame(id, call, request));
    });
  }
}
