// A viewer made of libraries that viewers use: ws, @foxglove/ws-protocol, protobufjs, @lichtblick/rosmsg2-serialization. It
// stores all messages.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';

// Loaded as CommonJS, because the modules of @foxglove/ws-protocol for `import` have no file extensions, which node requires.
const require = createRequire(import.meta.url);
const { FoxgloveClient } = require('@foxglove/ws-protocol');
const { parse } = require('@lichtblick/rosmsg');
const { MessageReader } = require('@lichtblick/rosmsg2-serialization');
const protobuf = require('protobufjs');
const { FileDescriptorSet } = require('protobufjs/ext/descriptor');
const WebSocket = require('ws');

export const names = ['foxglove.websocket.v1', 'foxglove.sdk.v1'];
const kinds = ['open', 'error', 'serverInfo', 'status', 'removeStatus', 'advertise', 'unadvertise', 'parameterValues',
  'advertiseServices', 'unadvertiseServices', 'connectionGraphUpdate', 'serviceCallFailure', 'message', 'time',
  'serviceCallResponse', 'fetchAssetResponse'];

export class Viewer {
  constructor(url, protocols = names) {
    this.received = [];  // in order: {kind, value}, kind is the name of FoxgloveClient's event
    this.channels = new Map();  // by topic
    this.services = new Map();  // by name
    this.topics = new Map();  // by subscription
    this.readers = new Map();  // by topic
    this.socket = new WebSocket(url, protocols);
    this.client = new FoxgloveClient({ ws: this.socket });
    for (const kind of kinds) this.client.on(kind, (value) => this.file(kind, value));
    this.client.on('close', (event) => this.file('close', event.code));
  }

  file(kind, value) {
    if (kind === 'advertise') for (const channel of value) this.channels.set(channel.topic, channel);
    if (kind === 'advertiseServices') for (const service of value) this.services.set(service.name, service);
    if (kind === 'message') value.topic = this.topics.get(value.subscriptionId);
    this.received.push({ kind, value });
    this.wake?.();
  }

  // Yields the received messages in order, from number `from` on; fails on an error or the end of the connection.
  async *coming({ from = 0, patience_s = 200, expected = [], missing = () => expected } = {}) {
    const deadline = performance.now() + 1000 * patience_s;
    for (let i = from; ; ++i) {
      while (i === this.received.length) {
        assert(performance.now() < deadline, `${missing()} did not come`);
        await new Promise((resolve) => {
          this.wake = resolve;
          setTimeout(resolve, 100);
        });
      }
      const { kind, value } = this.received[i];
      if (kind === 'error' && !expected.includes(kind)) throw value;
      assert(kind !== 'close' || expected.includes(kind), `closed with code ${value}`);
      yield { kind, value };
    }
  }

  async first(wanted, isIt = () => true, { from = 0 } = {}) {
    for await (const { kind, value } of this.coming({ from, expected: [wanted] })) if (kind === wanted && isIt(value)) return value;
  }

  all(kind) {
    return this.received.filter((one) => one.kind === kind).map((one) => one.value);
  }

  async greeted() {
    await this.first('advertiseServices');
    return this;
  }

  async close() {
    this.client.close();
    await this.first('close');
  }

  subscribe(...topics) {
    for (const topic of topics) this.topics.set(this.client.subscribe(this.channels.get(topic).id), topic);
  }

  // Returns the answer: {name: value} of the requested parameters; without names, of all.
  async parameters(...wanted) {
    const id = `get ${this.received.length}`;
    this.client.getParameters(wanted, id);
    return values(await this.first('parameterValues', (word) => word.id === id));
  }
  async set(name, value) {
    const id = `set ${this.received.length}`;
    this.client.setParameters([{ name, value }], id);
    return values(await this.first('parameterValues', (word) => word.id === id));
  }

  call(name, callId, text) {
    const request = { serviceId: this.services.get(name).id, callId, encoding: 'json', data: Buffer.from(text) };
    this.client.sendServiceCallRequest(request);
  }
  async answer(callId) {
    const { encoding, data } = await this.first('serviceCallResponse', (answer) => answer.callId === callId);
    assert.equal(encoding, 'json');
    return JSON.parse(bytes(data).toString());
  }

  // Reads a message with only its advertised schema.
  decode({ topic, data }) {
    if (!this.readers.has(topic)) this.readers.set(topic, readerOf(this.channels.get(topic)));
    return this.readers.get(topic)(bytes(data));
  }
}

const values = (word) => Object.fromEntries(word.parameters.map(({ name, value }) => [name, value]));
const bytes = (view) => Buffer.from(view.buffer, view.byteOffset, view.byteLength);

// The types of an advertised FileDescriptorSet.
export const typesOf = (schema) => protobuf.Root.fromDescriptor(FileDescriptorSet.decode(Buffer.from(schema, 'base64')));

function readerOf(channel) {
  if (channel.encoding === 'cdr') {
    assert.equal(channel.schemaEncoding, 'ros2msg');
    const reader = new MessageReader(parse(channel.schema, { ros2: true }));
    return (data) => reader.readMessage(data);
  }
  assert.deepEqual([channel.encoding, channel.schemaEncoding], ['protobuf', 'protobuf']);
  const type = typesOf(channel.schema).lookupType(channel.schemaName);
  return (data) => {
    const message = type.decode(data);
    // Reading drops fields that the schema lacks, so the message that is written again would differ.
    assert.equal(type.encode(message).finish().length, data.length, `${channel.topic} has fields that its schema lacks`);
    return type.toObject(message, { defaults: true, longs: BigInt });
  };
}
