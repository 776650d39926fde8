"""Reads every packet between sonar and driver from the network interface, and finds the connections and pings in them."""
from __future__ import annotations

import collections
import errno
import ipaddress
import pathlib
import select
import socket
import struct
import threading
import time
from typing import Callable, Collection, Deque, Dict, List, NamedTuple, Optional, Sequence, Tuple

from .truth import Make, Reader, TruePing

_ALL_PROTOCOLS, _OUTGOING = 0x0003, 4
_TIMESTAMP_NS = 35        # SO_TIMESTAMPNS
_FIN, _SYN, _RST, _PSH, _ACK = 1, 2, 4, 8, 16
_STREAM_KEPT = 48 << 20   # bytes of a connection kept for the hex view
_BEFORE, _AFTER = 512 << 10, 1280 << 10  # bytes of packets kept before and after the start of the fault
_WRAP = 1 << 32
_MOST_FRAGMENTED = 64     # datagrams whose fragments are kept at once


class Seen(NamedTuple):
    """A ping on the wire."""
    ping: TruePing
    mono: float       # when its last byte was sent [s, monotonic]
    connection: int   # number of the connection, from 1


class Connection:
    """One TCP connection of the driver."""

    def __init__(self, number: int, peer: str, mono: float, reader: Reader, is_request: Callable[[bytes], bool] = bool) -> None:
        self.number, self.peer, self.opened, self.established = number, peer, mono, False
        self.ended: Optional[float] = None
        self.ended_by = ""            # "driver FIN", "device RST", ...
        self.fires: List[float] = []  # when settings or requests were sent
        self.zero_windows = 0
        self.sent = 0                 # bytes of the device, without repetitions
        self.acked = 0                # number of these bytes that the driver acknowledged
        self.pings: List[Seen] = []
        self.stream = bytearray()
        self._first: Optional[int] = None  # sequence number of the device's first byte
        self._waiting: Dict[int, bytes] = {}
        self._reader, self._is_request = reader, is_request
        self._repeat_until: Optional[int] = None

    def end(self, mono: float, by: str) -> None:
        if self.ended is None:
            self.ended, self.ended_by = mono, by

    def from_device(self, mono: float, sequence: int, flags: int, payload: bytes) -> None:
        if flags & _SYN:
            self._first = (sequence + 1) % _WRAP
            return
        if flags & _RST:
            self.end(mono, "device RST" if self.established else "device refuses")
        elif flags & _FIN:
            self.end(mono, "device FIN")
        if not payload or self._first is None:
            return
        offset = (sequence - self._first) % _WRAP
        if offset >= _WRAP // 2:
            return
        self._waiting[offset] = max(payload, self._waiting.get(offset, b""), key=len)
        while True:
            at = next((o for o in sorted(self._waiting) if o <= self.sent), None)
            if at is None:
                return
            chunk = self._waiting.pop(at)[self.sent - at:]
            if chunk:
                self._take(mono, chunk)

    def _take(self, mono: float, chunk: bytes) -> None:
        self.sent += len(chunk)
        if len(self.stream) < _STREAM_KEPT:
            self.stream += chunk
        self.pings.extend(Seen(ping, mono, self.number) for ping in self._reader.feed(chunk))

    def from_driver(self, mono: float, sequence: int, ack: int, flags: int, window: int, payload: bytes) -> None:
        if flags & _ACK and self._first is not None and not flags & _SYN:
            self.established = True
            acked = (ack - self._first) % _WRAP
            if acked < _WRAP // 2:
                self.acked = max(self.acked, min(acked, self.sent))
        if flags & _RST:
            self.end(mono, "driver RST")
        elif flags & _FIN:
            self.end(mono, "driver FIN")
        elif window == 0 and not flags & _SYN:
            self.zero_windows += 1
        fresh = self._repeat_until is None or (sequence - self._repeat_until) % _WRAP < _WRAP // 2
        if payload and fresh:
            self._repeat_until = (sequence + len(payload)) % _WRAP
            if self._is_request(payload):
                self.fires.append(mono)


class DatagramFlow(Connection):
    """Datagrams between the sonar and one port of the driver, or of a multicast group. The flow begins with the driver's first
    datagram or the first one that the sonar pushes. Its end is not visible. Data on the wire count as delivered, because UDP has
    no acknowledgement."""

    def __init__(self, number: int, peer: str, mono: float, reader: Reader) -> None:
        super().__init__(number, peer, mono, reader)
        self.established = True

    def datagram(self, mono: float, payload: bytes) -> None:
        self._take(mono, payload)
        self.acked = self.sent


def sent_at(more: Sequence[Tuple[int, int, bytes]]) -> int:
    """Returns the kernel's time stamp [ns, UTC] of a packet, so that a busy computer, which reads it late, changes no time. Without a
    stamp it is the present time."""
    for level, kind, data in more:
        if (level, kind, len(data)) == (socket.SOL_SOCKET, _TIMESTAMP_NS, 16):
            seconds, ns = struct.unpack("qq", data)
            return int(seconds * 1_000_000_000 + ns)
    return time.time_ns()


class Capture(threading.Thread):
    """Captures packets from start() to stop(). It needs CAP_NET_RAW, which a process has in its own network namespace.

    interface: "lo" or the sonar's end of the veth pair. device: the sonar's address. port: where a driver connects first;
    tcp_ports: further ones. make: None reads no pings."""

    def __init__(self, interface: str, device: str, port: int, make: Optional[Make], tcp_ports: Collection[int] = ()) -> None:
        super().__init__(daemon=True)
        self._make = make or Make(())
        self._flows: Dict[Tuple[bytes, int], DatagramFlow] = {}
        self._fragments: Dict[Tuple[bytes, bytes, bytes], Dict[int, bytes]] = {}  # of datagrams that are not complete
        self._lo, self._device, self.port = interface == "lo", ipaddress.IPv4Address(device).packed, port
        self._tcp_ports = {port, *tcp_ports}
        self.connections: List[Connection] = []
        self.lost_packets = 0
        self._idle_at = 0.0  # the latest time when no packet was waiting
        self._open: Dict[Tuple[bytes, int, int], Connection] = {}  # by address and port of the driver, and port of the sonar
        self._stopping = threading.Event()
        self._lock = threading.Lock()
        self._before: Deque[Tuple[int, bytes]] = collections.deque()
        self._after: List[Tuple[int, bytes]] = []
        self._before_bytes = self._after_bytes = 0
        self._marked = False
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(_ALL_PROTOCOLS))
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, 33, 64 << 20)  # SO_RCVBUFFORCE
        except OSError:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 16 << 20)
        self._socket.setsockopt(socket.SOL_SOCKET, _TIMESTAMP_NS, 1)
        self._socket.bind((interface, _ALL_PROTOCOLS))
        self._socket.settimeout(0.1)

    def run(self) -> None:
        while not self._stopping.is_set():
            if not select.select([self._socket], [], [], 0)[0]:
                self._idle_at = time.monotonic()
            try:
                packet, more, _, source = self._socket.recvmsg(1 << 17, socket.CMSG_SPACE(16))
            except socket.timeout:
                continue
            except OSError as error:
                if error.errno in (errno.ENETDOWN, errno.EINTR):
                    continue
                return
            if self._lo and source[2] == _OUTGOING:  # loopback delivers every packet twice
                continue
            with self._lock:
                utc_ns = sent_at(more)
                self._packet(time.monotonic() - (time.time_ns() - utc_ns) / 1e9, utc_ns, packet)

    def stop(self) -> None:
        time.sleep(0.15)  # for the packets in flight
        self._stopping.set()
        self.join(5)
        self._count_lost()
        self._socket.close()

    def catch_up(self, timeout_s: float = 5.0) -> None:
        """Waits until all packets that were sent before this call are read."""
        now = time.monotonic()
        while self._idle_at <= now and time.monotonic() < now + timeout_s:
            time.sleep(0.01)
        self._count_lost()

    def _count_lost(self) -> None:
        try:
            self.lost_packets += struct.unpack("II", self._socket.getsockopt(263, 6, 8))[1]  # SOL_PACKET, PACKET_STATISTICS
        except OSError:
            pass

    def mark(self) -> None:
        """Marks the start of the fault. The packets kept until now stay; of later packets only a limited number of bytes is kept."""
        with self._lock:
            self._marked = True

    def seen(self) -> List[Seen]:
        with self._lock:
            return [seen for connection in self.connections for seen in connection.pings]

    def delivered(self) -> List[Seen]:
        """Returns the pings of which the driver's computer acknowledged every byte."""
        with self._lock:
            return [seen for connection in self.connections for seen in connection.pings if seen.ping.end <= connection.acked]

    # ---- packets
    def _packet(self, mono: float, utc_ns: int, packet: bytes) -> None:
        if packet[12:14] != b"\x08\x00" or len(packet) < 34:
            return
        ip = 14
        header = (packet[ip] & 15) * 4
        source, destination, protocol = packet[ip + 12:ip + 16], packet[ip + 16:ip + 20], packet[ip + 9]
        if self._device not in (source, destination):
            return
        end = ip + struct.unpack_from(">H", packet, ip + 2)[0]
        at = ip + header
        if protocol == 17:
            self._keep(utc_ns, packet)
            datagram = self._whole_datagram(packet, ip, at, end)
            if len(datagram) >= 8:
                self._udp(mono, source, destination, datagram)
        elif protocol == 6 and len(packet) >= at + 20:
            if end == ip:  # length 0: a segment too large for the field, from offloading
                end = len(packet)
            if self._tcp(mono, source, destination, packet, at, end):
                self._keep(utc_ns, packet)

    def _whole_datagram(self, packet: bytes, ip: int, at: int, end: int) -> bytes:
        """Returns a datagram with its UDP header, or empty bytes while fragments are missing."""
        place = struct.unpack_from(">H", packet, ip + 6)[0]
        offset, more = (place & 0x1FFF) * 8, bool(place & 0x2000)
        if offset == 0 and not more:
            return packet[at:end]
        key = (packet[ip + 12:ip + 16], packet[ip + 16:ip + 20], packet[ip + 4:ip + 6])
        if len(self._fragments) > _MOST_FRAGMENTED:  # otherwise datagrams that lost a fragment would accumulate
            self._fragments.clear()
        parts = self._fragments.setdefault(key, {})
        parts[offset] = packet[at:end]
        whole = b""
        for begin in sorted(parts):
            if begin != len(whole):
                return b""
            whole += parts[begin]
        if len(whole) < 8 or len(whole) < struct.unpack_from(">H", whole, 4)[0]:
            return b""
        del self._fragments[key]
        return whole

    def _udp(self, mono: float, source: bytes, destination: bytes, datagram: bytes) -> None:
        source_port, destination_port = struct.unpack_from(">HH", datagram)
        payload = datagram[8:]
        if source == self._device:
            key = (destination, destination_port)
            is_pushed = self._make.is_pushed is not None and self._make.is_pushed(payload)
            if is_pushed or source_port == self.port and key in self._flows:
                self._flow(mono, key).datagram(mono, payload)
        elif destination == self._device and destination_port == self.port:
            self._flow(mono, (source, source_port)).fires.append(mono)

    def _flow(self, mono: float, key: Tuple[bytes, int]) -> DatagramFlow:
        if key not in self._flows:
            peer = f"{ipaddress.IPv4Address(key[0])}:{key[1]}"
            self._flows[key] = DatagramFlow(len(self.connections) + 1, peer, mono, self._make.datagrams())
            self.connections.append(self._flows[key])
        return self._flows[key]

    def _tcp(self, mono: float, source: bytes, destination: bytes, packet: bytes, at: int, end: int) -> bool:
        source_port, destination_port, sequence, ack, offset, flags, window = struct.unpack_from(">HHIIBBH", packet, at)
        payload = packet[at + (offset >> 4) * 4:end]
        if source == self._device and source_port in self._tcp_ports:
            connection = self._open.get((destination, destination_port, source_port))
            if connection is not None:
                connection.from_device(mono, sequence, flags, payload)
            return True
        if destination == self._device and destination_port in self._tcp_ports:
            key = (source, source_port, destination_port)
            if flags & _SYN:
                old = self._open.get(key)
                if old is None or old.established or old.ended is not None:
                    peer = f"{ipaddress.IPv4Address(source)}:{source_port}"
                    self._open[key] = Connection(len(self.connections) + 1, peer, mono, self._make.stream(),
                                                 self._make.is_request)
                    self.connections.append(self._open[key])
                return True
            connection = self._open.get(key)
            if connection is not None:
                connection.from_driver(mono, sequence, ack, flags, window, payload)
            return True
        return False

    def _keep(self, utc_ns: int, packet: bytes) -> None:
        if self._marked:
            if self._after_bytes < _AFTER:
                self._after.append((utc_ns, packet))
                self._after_bytes += len(packet)
            return
        self._before.append((utc_ns, packet))
        self._before_bytes += len(packet)
        while self._before_bytes > _BEFORE:
            self._before_bytes -= len(self._before.popleft()[1])

    def write_pcapng(self, path: pathlib.Path, comment: str) -> int:
        """Writes the packets around the fault; returns their number."""
        packets = [*self._before, *self._after]
        path.write_bytes(pcapng(packets, comment))
        return len(packets)


def _block(kind: int, body: bytes) -> bytes:
    body += bytes(-len(body) % 4)
    size = struct.pack("<I", len(body) + 12)
    return struct.pack("<I", kind) + size + body + size


def _option(code: int, value: bytes) -> bytes:
    return struct.pack("<HH", code, len(value)) + value + bytes(-len(value) % 4)


def pcapng(packets: "List[Tuple[int, bytes]]", comment: str) -> bytes:
    """Returns a pcapng file of Ethernet packets whose times are ns since 1970."""
    end = _option(0, b"")
    parts = [_block(0x0A0D0D0A, struct.pack("<IHHq", 0x1A2B3C4D, 1, 0, -1) + _option(1, comment.encode()) + end),
             _block(1, struct.pack("<HHI", 1, 0, 0) + _option(9, b"\x09") + end)]
    for utc_ns, packet in packets:
        head = struct.pack("<IIIII", 0, utc_ns >> 32, utc_ns & 0xFFFFFFFF, len(packet), len(packet))
        parts.append(_block(6, head + packet))
    return b"".join(parts)


def hex_around(stream: bytes, offset: int, before: int = 32, after: int = 64) -> List[str]:
    """Returns lines of 16 bytes in hex; `>` marks the line that contains the offset."""
    first = max(0, offset - before) // 16 * 16
    lines = []
    for at in range(first, min(len(stream), offset + after), 16):
        row = stream[at:at + 16]
        text = "".join(chr(b) if 32 <= b < 127 else "." for b in row)
        lines.append(f"{'>' if at <= offset < at + 16 else ' '} {at:08x}  {row.hex(' '):<47}  {text}")
    return lines
