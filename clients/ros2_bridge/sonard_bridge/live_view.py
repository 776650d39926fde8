"""A client of sonard's live view (docs/live-view.md) that runs in its own thread and needs no ROS. It has a WebSocket, the part of
the Foxglove protocol that the bridge uses, and a decoder of protobuf with the field numbers of protocol/foxglove/schemas."""
from __future__ import annotations

import base64
import json
import os
import socket
import struct
import threading
import time
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple

from .conversions import Quaternion, Vector3
from .polling import WANTS_TOKEN

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10
LONGEST = 64 << 20   # limit for a message [bytes]
SILENCE_S = 30.0     # after this silence the connection counts as lost, because sonard sends a message every second
RETRY_S = 1.0


# ---- messages

def fields(data: bytes) -> Iterator[Tuple[int, Any]]:
    """Yields number and value of each field of a protobuf message. The value of a varint is an integer, that of others is bytes."""
    def varint() -> int:
        nonlocal at
        value = shift = 0
        while True:
            if at >= len(data) or shift > 63:
                raise ValueError("a message of the live view is cut off")
            value |= (data[at] & 0x7F) << shift
            shift, at = shift + 7, at + 1
            if data[at - 1] < 0x80:
                return value

    at = 0
    while at < len(data):
        tag = varint()
        kind = tag & 7
        if kind == 0:
            yield tag >> 3, varint()
            continue
        if kind not in (1, 2, 5):
            raise ValueError("a message of the live view has an unknown type of field")
        size = 8 if kind == 1 else 4 if kind == 5 else varint()
        if size > len(data) - at:
            raise ValueError("a message of the live view is cut off")
        at += size
        yield tag >> 3, data[at - size:at]


def last_of(data: bytes) -> Dict[int, Any]:
    """Returns the last value of each field, which is the valid one in protobuf."""
    return dict(fields(data))


def _doubles(data: bytes, count: int) -> List[float]:
    found = last_of(data)
    return [struct.unpack("<d", found[n])[0] if n in found else 0.0 for n in range(1, count + 1)]


def _floats(data: bytes) -> List[float]:
    return list(struct.unpack(f"<{len(data) // 4}f", data[:len(data) // 4 * 4]))


def _ns(stamp: bytes) -> int:
    found = last_of(stamp)
    return found.get(1, 0) * 10**9 + found.get(2, 0)


class Transform(NamedTuple):
    stamp_ns: int
    parent: str
    child: str
    position: Vector3
    orientation: Quaternion  # w, x, y, z


def transforms(payload: bytes) -> List[Transform]:
    """Decodes a foxglove.FrameTransforms."""
    all_ = []
    for _, one in fields(payload):
        found = last_of(one)
        x, y, z, w = _doubles(found.get(5, b""), 4)
        px, py, pz = _doubles(found.get(4, b""), 3)
        all_.append(Transform(_ns(found.get(1, b"")), found.get(2, b"").decode(), found.get(3, b"").decode(),
                              (px, py, pz), (w, x, y, z)))
    return all_


class Cloud(NamedTuple):
    stamp_ns: int
    frame: str
    stride: int
    columns: List[Tuple[str, int, int]]  # name, offset, type of sensor_msgs/PointField
    data: bytes


# The numbers of types in foxglove.PackedElementField, and those of the same types in sensor_msgs/PointField.
POINT_FIELD = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}


def cloud(payload: bytes) -> Cloud:
    """Decodes a foxglove.PointCloud."""
    columns = []
    for number, value in fields(payload):
        if number == 5:
            column = last_of(value)
            offset, = struct.unpack("<I", column.get(2, bytes(4)))
            columns.append((column.get(1, b"").decode(), offset, POINT_FIELD[column.get(3, 7)]))
    found = last_of(payload)
    stride, = struct.unpack("<I", found.get(4, bytes(4)))
    if stride == 0:
        raise ValueError("a cloud of the live view has points of no bytes")
    return Cloud(_ns(found.get(1, b"")), found.get(2, b"").decode(), stride, columns, found.get(6, b""))


class Truth(NamedTuple):
    stamp_ns: int
    azimuth_rad: List[float]
    range_m: List[float]
    nearest_m: float
    furthest_m: float


def truth(payload: bytes) -> Truth:
    """Decodes a sonar.v1.PingTruth."""
    found = last_of(payload)
    nearest, furthest = (struct.unpack("<d", found.get(n, bytes(8)))[0] for n in (5, 6))
    return Truth(_ns(found.get(1, b"")), _floats(found.get(3, b"")), _floats(found.get(4, b"")), nearest, furthest)


# ---- the connection

class Connection:
    """A WebSocket (RFC 6455). sonard sends each message as one frame."""

    def __init__(self, at: Tuple[str, int], token: str, patience_s: float = 5.0) -> None:
        self.buffer = bytearray()
        self.stream = socket.create_connection(at, patience_s)
        try:
            key = base64.b64encode(os.urandom(16)).decode()
            self.stream.sendall((f"GET / HTTP/1.1\r\nHost: {at[0]}:{at[1]}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                                 f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
                                 "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n" +
                                 (f"Authorization: Bearer {token}\r\n" if token else "") + "\r\n").encode())
            while b"\r\n\r\n" not in self.buffer:
                self._more()
        except BaseException:
            self.stream.close()
            raise
        head, _, rest = bytes(self.buffer).partition(b"\r\n\r\n")
        self.buffer = bytearray(rest)
        first = head.split(b"\r\n")[0].decode(errors="replace")
        if first.split()[1:2] != ["101"]:
            self.stream.close()
            raise ConnectionError(WANTS_TOKEN if " 401" in first else f"no live view of sonard: {first}")
        self.stream.settimeout(0.5)

    def _more(self) -> None:
        chunk = self.stream.recv(1 << 16)
        if not chunk:
            raise ConnectionError("sonard has closed the live view")
        self.buffer += chunk
        if len(self.buffer) > LONGEST + 16:
            raise ValueError("a message of the live view is too long")

    def send(self, opcode: int, payload: bytes) -> None:
        mask, size = os.urandom(4), len(payload)
        head = bytes([0x80 | opcode, 0x80 | size]) if size < 126 else bytes([0x80 | opcode, 0xFE]) + struct.pack(">H", size)
        self.stream.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def say(self, **word: Any) -> None:
        self.send(TEXT, json.dumps(word).encode())

    def _cut(self) -> Optional[Tuple[int, bytes]]:
        """Removes the first frame from the buffer and returns it; None if it is not complete yet."""
        size = self.buffer[1] & 127 if len(self.buffer) >= 2 else 0
        at = 4 if size == 126 else 10 if size == 127 else 2
        if len(self.buffer) < at:
            return None
        if at > 2:
            size = int.from_bytes(self.buffer[2:at], "big")
        if size > LONGEST:
            raise ValueError("a message of the live view is too long")
        if len(self.buffer) < at + size:
            return None
        frame = self.buffer[0] & 15, bytes(self.buffer[at:at + size])
        del self.buffer[:at + size]
        return frame

    def receive(self) -> Optional[Tuple[int, bytes]]:
        """Returns opcode and payload of the next message, or None if none arrives within the time-out of the socket. Replies to
        pings of the WebSocket."""
        while True:
            frame = self._cut()
            if frame is None:
                try:
                    self._more()
                except socket.timeout:
                    return None
            elif frame[0] == PING:
                self.send(PONG, frame[1][:125])
            elif frame[0] == CLOSE:
                raise ConnectionError("sonard has closed the live view: " + (frame[1][2:].decode(errors="replace") or "no reason"))
            elif frame[0] in (TEXT, BINARY):
                return frame


class LiveView(threading.Thread):
    """Receives messages until stop() and connects again after an error. `wants(topic)` decides whether to subscribe to a topic.
    `on_message(topic, ns, payload)` gets each message with the daemon's time. The topic is empty if the message has only the
    time."""

    def __init__(self, at: Tuple[str, int], token: str, wants: Callable[[str], bool],
                 on_message: Callable[[str, int, bytes], None], on_trouble: Callable[[str], None],
                 cloud_threshold: Optional[float] = None) -> None:
        super().__init__(name="live view", daemon=True)
        self.at, self.token, self.wants, self.cloud_threshold = at, token, wants, cloud_threshold
        self.on_message, self.on_trouble = on_message, on_trouble
        self.clock = ""  # clock of the daemon: realtime, stepped, lockstep, follow
        self.over = threading.Event()

    def stop(self) -> None:
        self.over.set()

    def run(self) -> None:
        while not self.over.is_set():
            try:
                connection = Connection(self.at, self.token)
                try:
                    self._look(connection)
                finally:
                    connection.stream.close()
            except Exception as error:  # no error may end the thread
                if not self.over.is_set():
                    self.on_trouble(str(error) if isinstance(error, (OSError, ValueError)) else
                                    f"the live view cannot be read: {error!r}")
            self.over.wait(RETRY_S)

    def _look(self, connection: Connection) -> None:
        topics: Dict[int, str] = {}
        received_s = time.monotonic()
        while not self.over.is_set():
            message = connection.receive()
            if message is None:
                if time.monotonic() - received_s > SILENCE_S:
                    raise ConnectionError(f"sonard's live view is silent for {SILENCE_S:g} s")
                continue
            received_s = time.monotonic()
            opcode, payload = message
            if opcode == TEXT:
                self._on_word(json.loads(payload), topics, connection)
            elif payload[:1] == b"\x01":
                subscription, ns = struct.unpack_from("<IQ", payload, 1)
                if subscription in topics:
                    self.on_message(topics[subscription], ns, payload[13:])
            elif payload[:1] == b"\x02":
                self.on_message("", struct.unpack_from("<Q", payload, 1)[0], b"")

    def _on_word(self, word: Dict[str, Any], topics: Dict[int, str], connection: Connection) -> None:
        if word.get("op") == "serverInfo":
            self.clock = word.get("metadata", {}).get("sonard.clock", "")
        elif word.get("op") == "unadvertise":
            for channel in word["channelIds"]:
                topics.pop(channel, None)
        elif word.get("op") == "advertise":
            new = {c["id"]: c["topic"] for c in word["channels"] if self.wants(c["topic"])}
            if not new:
                return
            if self.cloud_threshold is not None:
                values = [{"name": topic[:-len("cloud")] + "view/cloud_threshold", "value": self.cloud_threshold}
                          for topic in new.values() if topic.endswith("/cloud")]
                if values:
                    connection.say(op="setParameters", parameters=values)
            topics.update(new)
            connection.say(op="subscribe", subscriptions=[{"id": channel, "channelId": channel} for channel in new])
