"""Writes capture files: a conversation wrapped in IPv4, TCP and UDP headers that are made here. Tests of dissectors use them."""
import socket
import struct

DEVICE_PORT, STATUS_PORT, CLIENT_PORT = 52100, 52102, 40000
RAW_IP = 101  # link type: packets begin with the IP header


def _checksum(data):
    data += b"\0" * (len(data) % 2)
    total = sum(struct.unpack(f"!{len(data) // 2}H", data))
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


class Capture:
    """One device and one client; time advances by a millisecond per packet."""

    def __init__(self, device="127.90.0.1", client="127.90.0.2", device_port=DEVICE_PORT, snap_length=65535):
        self.ends = {"device": (socket.inet_aton(device), device_port), "client": (socket.inet_aton(client), CLIENT_PORT)}
        self.sequence = {"device": 1000, "client": 2000}
        self.snap_length, self.packets = snap_length, []

    def _packet(self, protocol, source, target, segment):
        length, number = 20 + len(segment), len(self.packets) & 0xFFFF
        header = struct.pack("!BBHHHBBH4s4s", 0x45, 0, length, number, 0x4000, 64, protocol, 0, source, target)
        self.packets.append(header[:10] + struct.pack("!H", _checksum(header)) + header[12:] + segment)

    def tcp(self, sender, data, flags=0x18):
        """Writes a segment from "device" or "client": ACK and PSH unless `flags` is given."""
        receiver = "client" if sender == "device" else "device"
        (source, source_port), (target, target_port) = self.ends[sender], self.ends[receiver]
        header = struct.pack("!HHIIBBHHH", source_port, target_port, self.sequence[sender] & 0xFFFFFFFF,
                             self.sequence[receiver] & 0xFFFFFFFF if flags & 0x10 else 0, 0x50, flags, 65535, 0, 0)
        pseudo = source + target + struct.pack("!BBH", 0, 6, len(header) + len(data))
        header = header[:16] + struct.pack("!H", _checksum(pseudo + header + data)) + header[18:]
        self._packet(6, source, target, header + data)
        self.sequence[sender] += len(data) + (1 if flags & 0x03 else 0)  # SYN and FIN count as one byte

    def connect(self):
        self.tcp("client", b"", flags=0x02)
        self.tcp("device", b"", flags=0x12)
        self.tcp("client", b"", flags=0x10)

    def udp(self, data, port=STATUS_PORT):
        (source, source_port), (target, _) = self.ends["device"], self.ends["client"]
        self._packet(17, source, target, struct.pack("!HHHH", source_port, port, 8 + len(data), 0) + data)

    def write(self, path):
        with open(path, "wb") as file:
            file.write(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, 65535, RAW_IP))
            for number, packet in enumerate(self.packets):
                kept = packet[:self.snap_length]
                file.write(struct.pack("<IIII", number // 1000, number % 1000 * 1000, len(kept), len(packet)) + kept)


def pieces(data, sizes):
    """Yields `data` cut into pieces of these sizes, the rest in pieces of the largest that fits a packet."""
    at, sizes = 0, iter(sizes)
    while at < len(data):
        size = next(sizes, 60000)
        yield data[at:at + size]
        at += size
