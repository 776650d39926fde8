// The binary frames of the Foxglove WebSocket protocol: first byte = opcode, all numbers little-endian.

const utf8 = new TextDecoder();

/// Returns {op: 'data', subscription, ns, payload}, {op: 'time', ns} or {op: 'answer', call, payload}; null for other opcodes.
export function readFrame(buffer) {
  const view = new DataView(buffer);
  switch (view.getUint8(0)) {
    case 1:
      return { op: 'data', subscription: view.getUint32(1, true), ns: Number(view.getBigUint64(5, true)), payload: new Uint8Array(buffer, 13) };
    case 2:
      return { op: 'time', ns: Number(view.getBigUint64(1, true)) };
    case 3: {
      const length = view.getUint32(9, true);
      return { op: 'answer', call: view.getUint32(5, true), payload: utf8.decode(new Uint8Array(buffer, 13 + length)) };
    }
    default:
      return null;
  }
}

/// Returns the frame that calls a service; `request` is sent as JSON.
export function callFrame(service, call, request) {
  const words = new TextEncoder().encode('json' + JSON.stringify(request));
  const frame = new Uint8Array(13 + words.length);
  const view = new DataView(frame.buffer);
  frame[0] = 2;
  view.setUint32(1, service, true);
  view.setUint32(5, call, true);
  view.setUint32(9, 4, true);
  frame.set(words, 13);
  return frame;
}
