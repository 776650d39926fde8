// Decodes protobuf messages with the descriptors that the daemon advertises with each channel. Fields are found by name; those
// that are not on the wire have protobuf's defaults. 64-bit numbers become doubles:
// those below 2^53 are exact, and time stamps in nanoseconds are rounded to a quarter of a microsecond.

const utf8 = new TextDecoder();

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }
  more() {
    return this.at < this.bytes.length;
  }
  take(count) {
    if (count > this.bytes.length - this.at) throw new Error('a protobuf message is cut off');
    this.at += count;
    return this.at - count;
  }
  varint(signed) {
    let value = 0;
    let wide = 0n;
    for (let shift = 0; shift < 70; shift += 7) {
      const byte = this.bytes[this.take(1)];
      if (shift < 28) value += (byte & 0x7f) * 2 ** shift;
      else wide |= BigInt(byte & 0x7f) << BigInt(shift);
      if (byte < 0x80) return wide === 0n ? value : Number(BigInt[signed ? 'asIntN' : 'asUintN'](64, wide | BigInt(value)));
    }
    throw new Error('a protobuf number is too long');
  }
  span() {
    const size = this.varint();
    const from = this.take(size);
    return this.bytes.subarray(from, from + size);
  }
  skip(wire) {
    if (wire === 0) this.varint();
    else if (wire === 1) this.take(8);
    else if (wire === 2) this.span();
    else if (wire === 5) this.take(4);
    else throw new Error('a protobuf field has an unknown wire type');
  }
}

const zigzag = (n) => (n % 2 ? -(n + 1) / 2 : n / 2);
// Type number of a descriptor -> wire type, reader, default.
const kinds = {
  1: [1, (r) => r.view.getFloat64(r.take(8), true), 0],
  2: [5, (r) => r.view.getFloat32(r.take(4), true), 0],
  3: [0, (r) => r.varint(true), 0],
  4: [0, (r) => r.varint(), 0],
  5: [0, (r) => r.varint(true), 0],
  6: [1, (r) => Number(r.view.getBigUint64(r.take(8), true)), 0],
  7: [5, (r) => r.view.getUint32(r.take(4), true), 0],
  8: [0, (r) => r.varint() !== 0, false],
  9: [2, (r) => utf8.decode(r.span()), ''],
  11: [2, null, null],
  12: [2, (r) => r.span(), new Uint8Array()],
  13: [0, (r) => r.varint(), 0],
  14: [0, (r) => r.varint(true), 0],
  15: [5, (r) => r.view.getInt32(r.take(4), true), 0],
  16: [1, (r) => Number(r.view.getBigInt64(r.take(8), true)), 0],
  17: [0, (r) => zigzag(r.varint()), 0],
  18: [0, (r) => zigzag(r.varint()), 0],
};

/// Makes a field of a message type. `type`: for a message, the full name of its type, such as sonar.v1.Event.
const field = (name, kind, repeated = false, type = '') => ({ name, kind, repeated, type });

// The part of descriptors that is needed to read descriptors themselves (google/protobuf/descriptor.proto).
const ofDescriptors = new Map([
  ['Set', new Map([[1, field('files', 11, true, 'File')]])],
  ['File', new Map([[2, field('package', 9)], [4, field('messages', 11, true, 'Message')]])],
  ['Message', new Map([[1, field('name', 9)], [2, field('fields', 11, true, 'Field')], [3, field('nested', 11, true, 'Message')]])],
  ['Field', new Map([[1, field('name', 9)], [3, field('number', 5)], [4, field('label', 14)], [5, field('kind', 14)], [6, field('type', 9)]])],
]);

/// Returns the message types of a FileDescriptorSet: name -> (number -> field). Names have no dot in front.
export function readDescriptors(bytes) {
  const types = new Map();
  const add = (message, prefix) => {
    const name = prefix + message.name;
    types.set(name, new Map(message.fields.map((f) => [f.number, field(f.name, f.kind, f.label === 3, f.type.replace(/^\./, ''))])));
    for (const inner of message.nested) add(inner, `${name}.`);
  };
  for (const file of decode(ofDescriptors, 'Set', bytes).files)
    for (const message of file.messages) add(message, file.package ? `${file.package}.` : '');
  return types;
}

// Wrapper types such as google.protobuf.DoubleValue hold one value. A field that is absent is decoded as null: no value was given.
const isWrapper = (type) => /^google\.protobuf\.(Double|Float|U?Int(32|64)|Bool|String)Value$/.test(type);

/// Returns `bytes` as an object of the type. Absent messages are null, absent lists are empty.
export function decode(types, type, bytes) {
  const fields = types.get(type);
  if (!fields) throw new Error(`the descriptors do not hold ${type}`);
  const out = {};
  for (const f of fields.values()) out[f.name] = f.repeated ? [] : (kinds[f.kind] ?? kinds[11])[2];
  const reader = new Reader(bytes);
  while (reader.more()) {
    const tag = reader.varint();
    const f = fields.get(Math.floor(tag / 8));
    const kind = f && kinds[f.kind];
    if (!kind) {
      reader.skip(tag % 8);
      continue;
    }
    if (f.repeated && kind[0] !== 2 && tag % 8 === 2) {  // packed
      const packed = new Reader(reader.span());
      while (packed.more()) out[f.name].push(kind[1](packed));
      continue;
    }
    if (kind[0] !== tag % 8) throw new Error(`${type}.${f.name} is not of the type that its descriptor says`);
    let value = kind[1] ? kind[1](reader) : decode(types, f.type, reader.span());
    if (isWrapper(f.type)) value = value.value;
    if (f.repeated) out[f.name].push(value);
    else out[f.name] = value;
  }
  return out;
}
