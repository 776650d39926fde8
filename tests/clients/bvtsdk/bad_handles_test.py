"""Calls the functions of both headers that begin with a handle, with null, stale, foreign and wrong handles: none crashes or
succeeds, and every out-parameter is written nevertheless."""
import ctypes
import re
import unittest

from prefixes import prefix

VALUES = {"int": ctypes.c_int, "unsigned int": ctypes.c_uint, "unsigned short": ctypes.c_ushort, "float": ctypes.c_float,
          "double": ctypes.c_double, "void": None}
INVALID = 7


def prototypes(abi):
    """Returns name, return type and [(type, name)] of every function."""
    text = re.sub(r"#define.*", "", (prefix(abi) / "include/bvt_sdk.h").read_text())
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    for result, name, arguments in re.findall(r"BVT_API ([^;()]*?)\b(BVT\w+)\(([^)]*)\);", text):
        split = [re.fullmatch(r"(.*?)(\w+)", a.strip(), re.S).groups() for a in arguments.split(",") if a.strip() != "void"]
        yield name, result.strip(), [(t.strip(), n) for t, n in split]


class Call:
    """Makes one call with arguments of the right types; every handle argument is a bad handle."""

    def __init__(self, library, prototype, handle):
        self.name, self.result, arguments = prototype
        self.outs, self.values = [], []
        for kind, name in arguments:
            self.values.append(self.argument(kind, name, handle))
        function = getattr(library, self.name)
        function.restype = self.result_type()
        function.argtypes = None
        self.answer = function(*self.values)

    def argument(self, kind, name, handle):
        if kind == "const char*":
            return ctypes.c_char_p(b"nothing")
        if kind == "char*":
            buffer = ctypes.create_string_buffer(b"\xff" * 64)
            self.outs.append(buffer)
            return buffer
        if kind.startswith("BVT"):
            if not kind.endswith("*"):
                return ctypes.c_void_p(handle)
            out = ctypes.c_void_p(0x55555555)
        elif kind.endswith("*"):
            inner = kind[:-1].strip()
            out = ctypes.c_void_p(0x55555555) if inner.endswith("*") else VALUES[inner](5)
            if name == "buffer":
                return ctypes.byref(out)  # an element of a list, which is not changed
        else:
            return VALUES[kind](32 if name == "buffer_size" else 1)
        self.outs.append(out)
        return ctypes.byref(out)

    def result_type(self):
        if self.result.endswith("*"):
            return ctypes.c_void_p
        return ctypes.c_int if self.result == "RetVal" else VALUES.get(self.result, ctypes.c_void_p)

    def untouched(self):
        """Returns the out-parameters that are not 0, null or empty."""
        return [o for o in self.outs if (o.value != b"" if isinstance(o.value, bytes) else bool(o.value))]


class BadHandles(unittest.TestCase):
    def check(self, abi, handles, skip):
        library = ctypes.CDLL(prefix(abi) / f"lib/libbvtsdk.so.{abi}")
        calls = 0
        for prototype in prototypes(abi):
            name, result, arguments = prototype
            if not arguments or not arguments[0][0].startswith("BVT"):
                continue
            for handle in handles(library):
                if skip(name, handle, library):
                    continue
                with self.subTest(name=name, handle=handle):
                    call = Call(library, prototype, handle)
                    calls += 1
                    if result == "RetVal":
                        self.assertEqual(call.answer, INVALID)
                    elif result != "void":
                        self.assertIn(call.answer, (0, None, 1000) if "RangeValue" in name else (0, None))
                    self.assertEqual(call.untouched(), [])
        self.assertGreater(calls, 150)

    def test_null_stale_and_foreign_handles_are_refused(self):
        def handles(library):
            library.BVTNavData_Create.restype = ctypes.c_void_p
            stale = library.BVTNavData_Create()
            library.BVTNavData_Destroy(ctypes.c_void_p(stale))
            return [None, stale, ctypes.addressof(ctypes.c_int(3)), 2**64 - 1]

        for abi in (3, 4):
            self.check(abi, handles, lambda *_: False)

    def test_handles_of_another_kind_are_refused(self):
        def handles(library):
            library.BVTSonar_Create.restype = library.BVTNavData_Create.restype = ctypes.c_void_p
            return [library.BVTSonar_Create(), library.BVTNavData_Create()]

        def skip(name, handle, library):
            del handle, library
            return name.startswith(("BVTSonar_", "BVTNavData_"))

        for abi in (3, 4):
            self.check(abi, handles, skip)

    def test_errors_have_names_and_texts_whatever_the_number(self):
        for abi in (3, 4):
            library = ctypes.CDLL(prefix(abi) / f"lib/libbvtsdk.so.{abi}")
            library.BVTError_GetName.restype = library.BVTError_GetString.restype = ctypes.c_char_p
            header = (prefix(abi) / "include/bvt_sdk_codes.h").read_text()
            codes = re.findall(r"(BVT_\w+) = (\d+)", re.search(r"typedef int RetVal;\s*enum \{(.*?)\}", header, re.S).group(1))
            self.assertGreater(len(codes), 40)
            for name, number in codes:
                self.assertEqual(library.BVTError_GetName(int(number)), name.encode())
            for number in (-1, 12345, 2**31 - 1, -2**31):
                self.assertTrue(library.BVTError_GetName(number))
                self.assertTrue(library.BVTError_GetString(number))


if __name__ == "__main__":
    unittest.main()
