"""Checks an MCAP file as strictly as the format's description allows: every CRC, length, offset, index and count.

It is written from the description (mcap.dev) and shares nothing with the C++ code. usage: mcap_checker.py FILE...
"""
import json
import struct
import sys
import zlib

from foxglove_viewer import Schema

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, STATISTICS, SUMMARY_OFFSET, DATA_END = (
    1, 2, 3, 4, 5, 6, 7, 8, 0x0B, 0x0E, 0x0F)


class Broken(Exception):
    pass


def expect(condition, what):
    if not condition:
        raise Broken(what)


class Fields:
    """Consumes the content of a record; remaining bytes are an error."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, size):
        expect(size <= len(self.data) - self.at, f"{size} bytes wanted, {len(self.data) - self.at} there")
        self.at += size
        return self.data[self.at - size:self.at]

    def u(self, size):
        return int.from_bytes(self.take(size), "little")

    def text(self):
        return self.take(self.u(4)).decode("utf-8")

    def pairs(self, key, value):
        inner, found = Fields(self.take(self.u(4))), []
        while inner.at < len(inner.data):
            found.append((key(inner), value(inner)))
        return found

    def end(self):
        expect(self.at == len(self.data), f"{len(self.data) - self.at} bytes too many")


def records(data, begin, end):
    """Yields (opcode, offset, content) of records that fill [begin, end) exactly."""
    at = begin
    while at < end:
        expect(end - at >= 9, f"no record fits at {at}")
        opcode, length = data[at], int.from_bytes(data[at + 1:at + 9], "little")
        expect(opcode != 0 and length <= end - at - 9, f"the record at {at} does not fit")
        yield opcode, at, data[at + 9:at + 9 + length]
        at += 9 + length
    expect(at == end, f"records end at {at}, not at {end}")


def schema_of(content):
    f = Fields(content)
    found = (f.u(2), f.text(), f.text(), f.take(f.u(4)))
    f.end()
    expect(found[0] != 0, "schema 0")
    return found


def channel_of(content):
    f = Fields(content)
    found = (f.u(2), f.u(2), f.text(), f.text(), tuple(f.pairs(Fields.text, Fields.text)))
    f.end()
    expect(len(dict(found[4])) == len(found[4]), "a key of the metadata appears twice")
    return found


class Checked:
    """The content of a valid file: .messages [(topic, log time, data)], .channels, .schemas, .chunks."""

    def __init__(self, data):
        self.data, self.schemas, self.channels, self.messages = data, {}, {}, []
        self.chunks, self.counts, self.sequences = [], {}, {}
        expect(data[:8] == MAGIC and data[-8:] == MAGIC, "magic numbers")
        self._check_footer()
        self._check_data()
        self._check_summary()

    def read(self, topic):
        """Returns the messages of a topic, decoded from JSON, or from protobuf with the schema in the file. Protobuf omits fields
        that are 0 or empty."""
        _, schema, _, encoding, _ = next(channel for channel in self.channels.values() if channel[2] == topic)
        _, name, _, described = self.schemas[schema]
        read = json.loads if encoding == "json" else lambda data: Schema(described).decode(name, data)
        return [read(data) for of, _, data in self.messages if of == topic]

    def _check_footer(self):
        opcode, self.footer_at, content = list(records(self.data, len(self.data) - 8 - 29, len(self.data) - 8))[0]
        expect(opcode == FOOTER and len(content) == 20, "footer")
        f = Fields(content)
        self.summary_at, self.offsets_at, crc = f.u(8), f.u(8), f.u(4)
        expect(0 < self.summary_at <= self.offsets_at <= self.footer_at, "offsets of the footer")
        expect(crc == zlib.crc32(self.data[self.summary_at:self.footer_at + 25]), "CRC of the summary")

    def _learn(self, opcode, content):
        found = schema_of(content) if opcode == SCHEMA else channel_of(content)
        known = self.schemas if opcode == SCHEMA else self.channels
        expect(known.setdefault(found[0], found) == found, f"two things with the id {found[0]}")
        if opcode == CHANNEL:
            expect(found[1] == 0 or found[1] in self.schemas, f"channel {found[2]} has a schema that was not declared")
            expect(found[1] == 0 or self.schemas[found[1]][2] == {"json": "jsonschema"}.get(found[3], found[3]),
                   f"channel {found[2]} and its schema differ in encoding")

    def _check_data(self):
        ended, pending = False, None
        for number, (opcode, at, content) in enumerate(records(self.data, 8, self.summary_at)):
            expect(not ended, "a record between the end of the data and the summary")
            expect((opcode == HEADER) == (number == 0), "the header comes first, and once")
            if opcode != MESSAGE_INDEX and pending:
                self._finish_chunk(pending, at)
                pending = None
            if opcode == HEADER:
                f = Fields(content)
                f.text(), f.text(), f.end()
            elif opcode in (SCHEMA, CHANNEL):
                self._learn(opcode, content)
            elif opcode == CHUNK:
                pending = self._check_chunk(at, content)
            elif opcode == MESSAGE_INDEX:
                expect(pending, "a message index without a chunk before it")
                self._check_index(pending, at, content)
            elif opcode == DATA_END:
                expect(int.from_bytes(content, "little") == zlib.crc32(self.data[:at]), "CRC of the data")
                ended = True
            else:
                raise Broken(f"opcode {opcode} in the data")
        expect(ended, "no end of the data")

    def _check_chunk(self, at, content):
        f = Fields(content)
        first, last, size, crc, compression = f.u(8), f.u(8), f.u(8), f.u(4), f.text()
        inner = f.take(f.u(8))
        f.end()
        expect(compression == "", "compressed")
        expect(size == len(inner) > 0, "size of a chunk")
        expect(crc == zlib.crc32(inner), f"CRC of the chunk at {at}")
        found = {}
        for opcode, offset, record in records(inner, 0, len(inner)):
            if opcode in (SCHEMA, CHANNEL):
                self._learn(opcode, record)
                continue
            expect(opcode == MESSAGE, f"opcode {opcode} in a chunk")
            channel, sequence, logged, _ = struct.unpack_from("<HIQQ", record)
            expect(channel in self.channels, f"message of channel {channel}, which was not declared")
            expect(sequence == self.sequences.setdefault(channel, 0), f"sequence of channel {channel}")
            self.sequences[channel] += 1
            found.setdefault(channel, []).append((logged, offset))
            self.messages.append((self.channels[channel][2], logged, record[22:]))
        times = [logged for entries in found.values() for logged, _ in entries]
        expect(times and (first, last) == (min(times), max(times)), "times of a chunk")
        return dict(at=at, length=9 + len(content), first=first, last=last, size=size, found=found, indexed={}, index_end=0)

    def _check_index(self, chunk, at, content):
        f = Fields(content)
        channel, entries = f.u(2), f.pairs(lambda g: g.u(8), lambda g: g.u(8))
        f.end()
        expect(channel not in chunk["indexed"], "two indexes of a channel")
        expect(sorted(entries) == sorted(chunk["found"].get(channel, [])) and entries, f"index of channel {channel} at {at}")
        chunk["indexed"][channel] = at

    def _finish_chunk(self, chunk, behind):
        expect(set(chunk["indexed"]) == set(chunk["found"]), "an index is missing")
        chunk["index_length"] = behind - chunk["at"] - chunk["length"]
        for channel, entries in chunk["found"].items():
            self.counts[channel] = self.counts.get(channel, 0) + len(entries)
        self.chunks.append(chunk)

    def _check_summary(self):
        groups, schemas, channels, indexes, statistics = [], {}, {}, [], []
        for opcode, at, content in records(self.data, self.summary_at, self.offsets_at):
            if not groups or groups[-1][0] != opcode:
                groups.append([opcode, at, 0])
            groups[-1][2] = at + 9 + len(content) - groups[-1][1]
            if opcode == SCHEMA:
                schemas[schema_of(content)[0]] = schema_of(content)
            elif opcode == CHANNEL:
                channels[channel_of(content)[0]] = channel_of(content)
            elif opcode == CHUNK_INDEX:
                indexes.append(content)
            elif opcode == STATISTICS:
                statistics.append(content)
            else:
                raise Broken(f"opcode {opcode} in the summary")
        expect(len({group[0] for group in groups}) == len(groups), "a group of the summary in two parts")
        expect(schemas == self.schemas and channels == self.channels, "schemas and channels of the summary")
        expect(len(statistics) == 1 and len(indexes) == len(self.chunks), "statistics and chunk indexes")
        for content, chunk in zip(indexes, self.chunks):
            self._check_chunk_index(content, chunk)
        self._check_statistics(statistics[0])
        said = []
        for opcode, _, content in records(self.data, self.offsets_at, self.footer_at):
            expect(opcode == SUMMARY_OFFSET and len(content) == 17, "summary offsets")
            said.append([content[0], *struct.unpack("<QQ", content[1:])])
        expect(said == groups, "places of the summary's groups")

    @staticmethod
    def _check_chunk_index(content, chunk):
        f = Fields(content)
        said = (f.u(8), f.u(8), f.u(8), f.u(8), dict(f.pairs(lambda g: g.u(2), lambda g: g.u(8))), f.u(8), f.text(), f.u(8), f.u(8))
        f.end()
        expect(said == (chunk["first"], chunk["last"], chunk["at"], chunk["length"], chunk["indexed"], chunk["index_length"], "",
                        chunk["size"], chunk["size"]), "a chunk index")

    def _check_statistics(self, content):
        f = Fields(content)
        said = (f.u(8), f.u(2), f.u(4), f.u(4), f.u(4), f.u(4), f.u(8), f.u(8), dict(f.pairs(lambda g: g.u(2), lambda g: g.u(8))))
        f.end()
        first = min((chunk["first"] for chunk in self.chunks), default=0)
        last = max((chunk["last"] for chunk in self.chunks), default=0)
        expect(said == (len(self.messages), len(self.schemas), len(self.channels), 0, 0, len(self.chunks), first, last, self.counts),
               f"statistics {said}")


def check(data):
    """Returns a Checked, or raises Broken with the reason."""
    try:
        return Checked(bytes(data))
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise Broken(f"not even readable: {error}") from error


def main():
    for name in sys.argv[1:]:
        with open(name, "rb") as file:
            checked = check(file.read())
        print(f"{name}: sound, {len(checked.messages)} messages in {len(checked.chunks)} chunks, {len(checked.channels)} channels")


if __name__ == "__main__":
    main()
