"""A strict viewer of the live view, written without libraries from the specifications of WebSocket (RFC 6455), Foxglove and
protobuf. It shares nothing with the C++ code. Any deviation from the specifications is an AssertionError."""
import base64
import hashlib
import json
import os
import socket
import struct
import time

NAMES = ("foxglove.websocket.v1", "foxglove.sdk.v1")
GUID = b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


class Refused(Exception):
    def __init__(self, status, headers, body):
        super().__init__(f"{status} {body}")
        self.status, self.headers, self.body = status, headers, body


class Closed(Exception):
    """The server closed the connection. Code 0 means that no close frame came."""

    def __init__(self, code):
        super().__init__(code)
        self.code = code


class Viewer:
    def __init__(self, address, port=8088, path="/", protocols=", ".join(NAMES), headers=None, small_window=False, patience_s=200):
        self.socket = socket.socket()
        if small_window:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        self.socket.settimeout(patience_s)
        self.socket.connect((address, port))
        self.buffer = b""
        self.frames = 0  # number of received data frames
        self.words, self.messages, self.times = [], [], []
        self.channels, self.subscriptions, self.info, self.schemas = {}, {}, None, {}
        key = base64.b64encode(os.urandom(16)).decode()
        asked = {"Host": f"{address}:{port}", "Connection": "keep-alive, Upgrade", "Upgrade": "websocket",
                 "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": key, "Sec-WebSocket-Protocol": protocols, **(headers or {})}
        lines = [f"GET {path} HTTP/1.1"] + [f"{name}: {value}" for name, value in asked.items() if value is not None]
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        while b"\r\n\r\n" not in self.buffer:
            self._more()
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        status, *lines = head.decode().split("\r\n")
        answered = {name.lower(): value.strip() for name, value in (line.split(":", 1) for line in lines)}
        code = int(status.split()[1])
        if code != 101:
            while len(self.buffer) < int(answered.get("content-length", 0)):
                self._more()
            self.socket.close()
            raise Refused(code, answered, self.buffer.decode())
        assert answered["upgrade"].lower() == "websocket" and answered["connection"].lower() == "upgrade", answered
        assert answered["sec-websocket-accept"] == base64.b64encode(hashlib.sha1(key.encode() + GUID).digest()).decode(), answered
        assert "sec-websocket-extensions" not in answered, answered
        self.protocol = answered["sec-websocket-protocol"]
        assert self.protocol in [p.strip() for p in protocols.split(",")], answered

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    # ---- frames

    def _more(self):
        try:
            chunk = self.socket.recv(1 << 16)
        except ConnectionResetError:
            chunk = b""
        if not chunk:
            raise Closed(0)
        self.buffer += chunk

    def _take(self, count):
        while len(self.buffer) < count:
            self._more()
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def send_frame(self, opcode, payload, final=True):
        mask = os.urandom(4)
        length = len(payload)
        head = bytes([opcode | (0x80 if final else 0)])
        head += bytes([0x80 | length]) if length < 126 else bytes([0xFE]) + struct.pack(">H", length) if length < 65536 else \
            bytes([0xFF]) + struct.pack(">Q", length)
        self.socket.sendall(head + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def frame(self):
        """Returns the next message: (is_text, payload). It must be one frame. WebSocket pings do not extend the timeout."""
        deadline = time.monotonic() + self.socket.gettimeout()
        while time.monotonic() < deadline:
            first, second = self._take(2)
            assert first & 0x70 == 0 and second & 0x80 == 0, "the frame has reserved bits or a mask"
            opcode, length = first & 15, second & 127
            if length == 126:
                length = struct.unpack(">H", self._take(2))[0]
                assert length >= 126, "the length has more bytes than it needs"
            elif length == 127:
                length = struct.unpack(">Q", self._take(8))[0]
                assert length >= 65536, "the length has more bytes than it needs"
            payload = self._take(length)
            if opcode == 9:
                self.send_frame(10, payload)
            elif opcode == 8:
                raise Closed(struct.unpack(">H", payload[:2])[0] if payload else 1005)
            elif opcode != 10:
                assert opcode in (1, 2) and first & 0x80, f"message in several frames, opcode {opcode}"
                self.frames += 1
                return opcode == 1, payload
        raise TimeoutError("no message")

    # ---- the protocol

    def say(self, **word):
        self.send_frame(1, json.dumps(word).encode())

    def receive(self):
        """Stores and returns the next message: ("word", dict), ("message", (topic, ns, bytes)), ("time", ns), ("playback", dict)
        or ("answer", ...)."""
        is_text, payload = self.frame()
        if is_text:
            word = json.loads(payload.decode())
            self.words.append(word)
            if word["op"] == "serverInfo":
                self.info = word
            elif word["op"] == "advertise":
                for channel in word["channels"]:
                    assert channel["id"] not in self.channels, "the same id twice"
                    self.channels[channel["id"]] = channel
            elif word["op"] == "unadvertise":
                for channel in word["channelIds"]:
                    del self.channels[channel]
            return "word", word
        if payload[0] == 1:
            subscription, ns = struct.unpack_from("<IQ", payload, 1)
            message = self.channels[self.subscriptions[subscription]]["topic"], ns, payload[13:]
            self.messages.append(message)
            return "message", message
        if payload[0] == 2:
            assert len(payload) == 9
            self.times.append(struct.unpack_from("<Q", payload, 1)[0])
            return "time", self.times[-1]
        if payload[0] == 5:
            state, ns, speed, did_seek, length = struct.unpack_from("<BQfBI", payload, 1)
            assert len(payload) == 19 + length, payload
            return "playback", {"state": ("playing", "paused", "buffering", "ended")[state], "ns": ns, "speed": speed, "did_seek": did_seek,
                                "request": payload[19:].decode()}
        assert payload[0] == 3, payload[:1]
        service, call, length = struct.unpack_from("<III", payload, 1)
        return "answer", (service, call, payload[13:13 + length].decode(), payload[13 + length:])

    def wait_for(self, wanted, patience_s=200):
        """Returns the first received item for which wanted(kind, value) is true."""
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            kind, value = self.receive()
            if wanted(kind, value):
                return value
        raise AssertionError("the expected message did not come")

    def greeted(self):
        self.wait_for(lambda kind, value: kind == "word" and value["op"] == "advertise")
        return self

    def channel(self, topic):
        return next(id for id, channel in self.channels.items() if channel["topic"] == topic)

    def subscribe(self, *topics):
        new = []
        for topic in topics:
            subscription = 1000 + len(self.subscriptions)
            self.subscriptions[subscription] = self.channel(topic)
            new.append({"id": subscription, "channelId": self.channel(topic)})
        self.say(op="subscribe", subscriptions=new)

    def subscribed(self, *topics):
        """Subscribes, and waits until the server has handled the subscription."""
        self.subscribe(*topics)
        self.parameters("subscribed", "/none")  # answered after the subscription
        return self

    def parameters(self, request="all", *names):
        """Returns the values of these parameters by name, or of all parameters if no name is given."""
        self.say(op="getParameters", parameterNames=list(names), id=request)
        return {p["name"]: p.get("value") for p in self._values_for(request)}

    def set(self, name, value):
        """Sets a parameter. Returns its value afterwards; None if there is no such parameter."""
        self.say(op="setParameters", parameters=[{"name": name, "value": value}], id="set " + name)
        values = self._values_for("set " + name)
        return values[0].get("value") if values else None

    def _values_for(self, request):
        return self.wait_for(lambda kind, word: kind == "word" and word["op"] == "parameterValues" and word.get("id") == request)["parameters"]

    def request(self, name, payload, call=1):
        """Calls a service without waiting for its answer."""
        services = next(word for word in self.words if word["op"] == "advertiseServices")["services"]
        service = next(s["id"] for s in services if s["name"] == name)
        self.send_frame(2, struct.pack("<BIII", 2, service, call, 4) + b"json" + payload)

    def call(self, name, payload, call=1):
        """Returns the answer of a service and "answer", or the message of its failure and "word"."""
        self.request(name, payload, call)
        kinds = []

        def is_answer(kind, value):
            kinds.append(kind)
            return kind == "answer" or (kind == "word" and value["op"] == "serviceCallFailure")

        return self.wait_for(is_answer), kinds[-1]

    def first_of(self, topic, patience_s=200):
        """Returns the first message of the channel, decoded; waits for it if there is none yet."""
        found = [payload for name, _, payload in self.messages if name == topic]
        if not found:
            found = [self.wait_for(lambda kind, value: kind == "message" and value[0] == topic, patience_s)[2]]
        return self.decode(topic, found[0])

    def decode(self, topic, payload):
        channel = self.channels[self.channel(topic)]
        assert channel["encoding"] == channel["schemaEncoding"] == "protobuf", channel["encoding"]
        if channel["schema"] not in self.schemas:
            self.schemas[channel["schema"]] = Schema(base64.b64decode(channel["schema"]))
        return self.schemas[channel["schema"]].decode(channel["schemaName"], payload)

    def status(self, part="", patience_s=200):
        """Returns the next status message that contains this text."""
        return self.wait_for(lambda kind, value: kind == "word" and value["op"] == "status" and part in value["message"], patience_s)


def varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 0x7F) << shift
        shift += 7
        at += 1
        if data[at - 1] < 0x80:
            return value, at


def fields(data):
    """Yields (number, wire type, value) of a protobuf message."""
    at = 0
    while at < len(data):
        tag, at = varint(data, at)
        number, wire = tag >> 3, tag & 7
        if wire == 0:
            value, at = varint(data, at)
        else:
            length = {1: 8, 5: 4}.get(wire)
            if length is None:
                assert wire == 2, wire
                length, at = varint(data, at)
            value, at = data[at:at + length], at + length
            assert len(value) == length, "cut off"
        yield number, wire, value


class Schema:
    """The messages described by a FileDescriptorSet (google/protobuf/descriptor.proto), as far as needed for decoding."""

    def __init__(self, descriptor_set):
        self.messages = {}
        for _, _, file in fields(descriptor_set):
            package = next((v.decode() for n, _, v in fields(file) if n == 2), "")
            for number, _, value in fields(file):
                if number == 4:
                    self._add("." + package, value)

    def _add(self, scope, message):
        name = scope + "." + next(v.decode() for n, _, v in fields(message) if n == 1)
        self.messages[name] = {}
        for number, _, value in fields(message):
            if number == 2:
                field = {n: v for n, _, v in fields(value)}
                self.messages[name][field[3]] = (field[1].decode(), field[4], field[5], field.get(6, b"").decode())
            elif number == 3:
                self._add(name, value)

    def decode(self, name, data):
        """Returns fields by name, without missing ones; repeated fields are lists. Unknown fields are an error."""
        known = self.messages["." + name]
        out = {}
        for number, wire, value in fields(data):
            field, label, kind, type_name = known[number]
            values = self._values(kind, type_name, wire, value)
            if label == 3:
                out.setdefault(field, []).extend(values)
            else:
                out[field], = values
        return out

    def _values(self, kind, type_name, wire, value):
        if kind == 11:
            return [self.decode(type_name[1:], value)]
        if kind in (9, 12):
            return [value.decode() if kind == 9 else value]
        packed = {1: "d", 2: "f", 6: "Q", 7: "I", 15: "i", 16: "q"}.get(kind)
        if packed:
            return list(struct.unpack(f"<{len(value) // struct.calcsize(packed)}{packed}", value))
        if wire == 2:
            all_, at = [], 0
            while at < len(value):
                one, at = varint(value, at)
                all_.append(one)
            return all_
        return [bool(value) if kind == 8 else value - (1 << 64) if kind in (3, 5) and value >> 63 else value]
