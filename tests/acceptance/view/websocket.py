"""WebSocket frames (RFC 6455) over a socket, for servers and clients of tests. Standard library only."""
import base64
import hashlib
import os
import struct

TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


def accept_key(key):
    return base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest()).decode()


class WebSocket:
    """A WebSocket after the handshake. `masks`: True for clients."""

    def __init__(self, stream, masks=False):
        self.stream, self.masks = stream, masks
        self.file = stream.makefile("rb")

    def close(self):
        self.file.close()
        self.stream.close()

    @classmethod
    def connect(cls, stream, host, target):
        key = base64.b64encode(os.urandom(16)).decode()
        stream.sendall((f"GET {target} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                        f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n\r\n").encode())
        socket = cls(stream, masks=True)
        status = socket.file.readline()
        if b" 101 " not in status:
            raise ConnectionError(status.decode())
        while socket.file.readline() not in (b"\r\n", b""):
            pass
        return socket

    def send(self, kind, payload):
        data = payload.encode() if isinstance(payload, str) else payload
        size, mask = len(data), 0x80 if self.masks else 0
        head = bytes([0x80 | kind])
        if size < 126:
            head += bytes([mask | size])
        elif size < 1 << 16:
            head += bytes([mask | 126]) + struct.pack(">H", size)
        else:
            head += bytes([mask | 127]) + struct.pack(">Q", size)
        if self.masks:
            key = os.urandom(4)
            head += key
            data = (int.from_bytes(data, "big") ^ int.from_bytes((key * (size // 4 + 1))[:size], "big")).to_bytes(size, "big")
        self.stream.sendall(head + data)

    def receive(self):
        """Returns (kind, payload) of the next message; None if the connection is closed."""
        kind, whole = 0, b""
        while True:
            head = self.file.read(2)
            if len(head) < 2:
                return None
            size = head[1] & 0x7F
            if size == 126:
                size, = struct.unpack(">H", self.file.read(2))
            elif size == 127:
                size, = struct.unpack(">Q", self.file.read(8))
            key = self.file.read(4) if head[1] & 0x80 else b""
            data = self.file.read(size)
            if len(data) < size:
                return None
            if key:
                data = bytes(b ^ key[i % 4] for i, b in enumerate(data))
            opcode = head[0] & 15
            if opcode == CLOSE:
                return None
            if opcode == PING:
                self.send(PONG, data)
            if opcode in (PING, PONG):
                continue
            kind, whole = opcode or kind, whole + data
            if head[0] & 0x80:
                return kind, whole
