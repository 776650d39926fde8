#!/usr/bin/env python3
"""right_driver.py with one planted fault, which the judge must find.

usage: planted_driver.py ADDRESS [PORT] --plant NAME
"""
import json
import select
import socket
import sys
import time
import zlib

import right_driver
from right_driver import HEADER, MAGIC, PING_ID, Driver, Stream, fire_message, sizes_of


class IgnoresFin(Driver):
    """Treats the end of the stream as "no data yet"."""

    def serve(self, sonar):
        while True:
            data = sonar.recv(1 << 18)
            if data:
                self.received(sonar, data)
            else:
                time.sleep(0.05)


class TrustsLengths(Driver):
    """Waits for the number of bytes in the header, and publishes an image of the sizes in the message."""

    def serve(self, sonar):
        sonar.settimeout(right_driver.SILENT_S)
        data = bytearray()

        def take(count):
            while len(data) < count:
                received = sonar.recv(1 << 18)
                if not received:
                    raise ConnectionError("the sonar closed the connection")
                data.extend(received)
            taken = bytes(data[:count])
            del data[:count]
            return taken

        while True:
            header = take(HEADER.size)
            magic, _, _, kind, version, payload, _ = HEADER.unpack(header)
            if magic != MAGIC:
                raise ConnectionError("lost the stream")
            message = header + take(payload)
            if kind == PING_ID and len(message) > 200:
                number, rows, beams, width, _, offset, _, _ = sizes_of(message, min(version, 2))
                samples = message[offset:offset + rows * beams * width]
                self.publish({"id": number, "crc32": zlib.crc32(samples), "rows": rows, "beams": beams, "settings": b""})
                self.pause_s = 0.25


class NeverSendsSettingsAgain(Driver):
    """Sends its settings on the first connection only."""
    sent = False

    def connect(self):
        if not self.sent:
            self.sent = True
            return super().connect()
        sonar = socket.create_connection((self.address, self.port), timeout=right_driver.CONNECT_S)
        self.stream, self.seen = Stream(), None
        return sonar

    def serve(self, sonar):
        while True:
            ready, _, _ = select.select([sonar], [], [], right_driver.SILENT_S)
            data = sonar.recv(1 << 18) if ready else b""
            if not data:
                raise ConnectionError("no data")
            for ping in self.stream.feed(data):
                self.publish(ping)


class LeaksDescriptor(Driver):
    """Opens a file for each connection and never closes it."""
    kept = []

    def connect(self):
        self.kept.append(open("/dev/null", "rb"))
        return super().connect()


class GluesPings(Driver):
    """Keeps the first part of a ping when the connection ends, and appends the bytes of the next connection to it."""

    def connect(self):
        sonar = socket.create_connection((self.address, self.port), timeout=right_driver.CONNECT_S)
        sonar.sendall(fire_message())
        return sonar

    def received(self, sonar, data):
        self.waiting = getattr(self, "waiting", b"") + data
        any_ping = False
        while len(self.waiting) >= 200:
            if self.waiting[:2] != MAGIC:
                found = self.waiting.find(MAGIC, 1)
                self.waiting = self.waiting[found:] if found > 0 else self.waiting[-1:]
                continue
            _, _, _, kind, version, payload, _ = HEADER.unpack_from(self.waiting)
            size = HEADER.size + payload
            if kind != PING_ID or version > 2 or size > right_driver.LONGEST:
                self.waiting = self.waiting[1:]
                continue
            if len(self.waiting) < size:
                break
            message, self.waiting = self.waiting[:size], self.waiting[size:]
            number, rows, beams, width, _, offset, image, total = sizes_of(message, version)
            if total == size and offset + image == total and image == rows * beams * width:
                any_ping = True
                self.publish({"id": number, "crc32": zlib.crc32(message[offset:]), "settings": message[16:37]})
        return any_ping


class ExitsWhenRefused(Driver):
    def connect(self):
        try:
            return super().connect()
        except ConnectionRefusedError:
            sys.exit("connection refused")


class FloodsLog(Driver):
    """Prints a log line for each byte that does not fit."""

    def log(self, text):
        count = int(text.rpartition(" ")[2]) if text.startswith("skipped bytes") else 1
        for _ in range(count):
            print("error: bad header", file=sys.stderr, flush=True)


class PublishesDuplicates(Driver):
    def publish(self, ping):
        self.seen = None
        return super().publish(ping)


class AllocatesByLength(Driver):
    """Allocates the size in a header before it checks the header."""

    def received(self, sonar, data):
        at = data.find(MAGIC)
        while 0 <= at <= len(data) - HEADER.size:
            _, _, _, kind, _, payload, _ = HEADER.unpack_from(data, at)
            if kind == PING_ID:
                self.room = b"\1" * min(payload, 1 << 30)
            at = data.find(MAGIC, at + 1)
        return super().received(sonar, data)


class NeverTimesOut(Driver):
    def serve(self, sonar):
        sonar.settimeout(None)
        while True:
            data = sonar.recv(1 << 18)
            if not data:
                raise ConnectionError("the sonar closed the connection")
            self.received(sonar, data)


class RepeatsLastPing(Driver):
    """Publishes the last ping again while no ping arrives."""
    last = None

    def connect(self):
        self.last = None
        return super().connect()

    def publish(self, ping):
        self.last = {key: value for key, value in ping.items() if key != "settings"}
        return super().publish(ping)

    def serve(self, sonar):
        last = time.monotonic()
        while True:
            ready, _, _ = select.select([sonar], [], [], 0.4)
            if ready:
                data = sonar.recv(1 << 18)
                if not data:
                    raise ConnectionError("the sonar closed the connection")
                self.received(sonar, data)
                last = time.monotonic()
            elif time.monotonic() - last > right_driver.SILENT_S:
                raise TimeoutError("no ping")
            elif self.last:
                print(json.dumps(self.last), flush=True)


PLANTS = {"ignores-fin": IgnoresFin, "trusts-lengths": TrustsLengths, "never-sends-settings-again": NeverSendsSettingsAgain,
          "leaks-descriptor": LeaksDescriptor, "glues-pings": GluesPings, "exits-when-refused": ExitsWhenRefused,
          "floods-log": FloodsLog, "publishes-duplicates": PublishesDuplicates, "allocates-by-length": AllocatesByLength,
          "never-times-out": NeverTimesOut, "repeats-last-ping": RepeatsLastPing}

if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--plant"]
    plant = next((word for word in words if word in PLANTS), None)
    if plant is None:
        sys.exit(f"--plant must be one of {', '.join(PLANTS)}")
    words.remove(plant)
    PLANTS[plant](words[0], *map(int, words[1:])).run()
