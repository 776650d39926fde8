"""Writes protobuf messages from dictionaries, with the descriptors that protoc makes from our .proto files. Standard library
only."""
import pathlib
import struct
import subprocess
import tempfile

VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
# Type number of a descriptor -> wire type, struct format.
NUMBERS = {1: (FIXED64, "<d"), 2: (FIXED32, "<f"), 6: (FIXED64, "<Q"), 7: (FIXED32, "<I"), 15: (FIXED32, "<i"), 16: (FIXED64, "<q")}
MESSAGE, STRING, RAW = 11, 9, 12


def varint(value):
    value &= (1 << 64) - 1
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def fields_of(data):
    """Yields (number, value) of each field; fields with a length have bytes."""
    at = 0

    def number():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            at += 1
            value |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return value
    while at < len(data):
        tag = number()
        if tag & 7 == BYTES:
            size = number()
            yield tag >> 3, data[at:at + size]
            at += size
        elif tag & 7 == VARINT:
            yield tag >> 3, number()
        else:
            size = 8 if tag & 7 == FIXED64 else 4
            yield tag >> 3, data[at:at + size]
            at += size


class Schema:
    """The messages of .proto files: Schema(["protocol/control/control.proto", ...], root)."""

    def __init__(self, protos, root):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "set"
            includes = sorted({str(pathlib.Path(root) / pathlib.Path(p).parent) for p in protos})
            subprocess.run(["protoc", *[f"-I{i}" for i in includes], "--include_imports", f"--descriptor_set_out={out}",
                            *[str(pathlib.Path(root) / p) for p in protos]], check=True)
            self.descriptors = out.read_bytes()
        self.types = {}
        for number, data in fields_of(self.descriptors):
            if number == 1:
                self._add_file(data)

    def _add_file(self, data):
        parts = list(fields_of(data))
        package = next((v.decode() for n, v in parts if n == 2), "")
        for number, value in parts:
            if number == 4:
                self._add_message(value, package)

    def _add_message(self, data, prefix):
        parts = list(fields_of(data))
        name = f"{prefix}.{next(v.decode() for n, v in parts if n == 1)}"
        fields = {}
        for number, value in parts:
            if number == 2:
                of = dict(fields_of(value))
                fields[of[1].decode()] = (of[3], of[5], of.get(4) == 3, of.get(6, b"").decode().lstrip("."))
            elif number == 3:
                self._add_message(value, name)
        self.types[name] = fields

    def encode(self, name, message):
        fields, out = self.types[name], bytearray()
        for key, value in message.items():
            number, kind, repeated, of = fields[key]
            for one in value if repeated and kind in (MESSAGE, STRING, RAW) else [value]:
                if one is None:
                    continue
                if repeated and kind not in (MESSAGE, STRING, RAW):
                    packed = b"".join(self._scalar(kind, v)[1] for v in one)
                    out += varint(number << 3 | BYTES) + varint(len(packed)) + packed
                    continue
                wire, data = self._value(kind, of, one)
                out += varint(number << 3 | wire) + data
        return bytes(out)

    def _value(self, kind, of, value):
        if kind == MESSAGE:
            if of.startswith("google.protobuf.") and not isinstance(value, dict):
                value = {"value": value}
            data = self.encode(of, value)
        elif kind == STRING:
            data = value.encode()
        elif kind == RAW:
            data = bytes(value)
        else:
            return self._scalar(kind, value)
        return BYTES, varint(len(data)) + data

    @staticmethod
    def _scalar(kind, value):
        if kind in NUMBERS:
            wire, form = NUMBERS[kind]
            return wire, struct.pack(form, value)
        return VARINT, varint(int(value))
