"""Tests a Python host without restype and argtypes: ctypes then cuts every handle to a C int, and every call must still work."""
import ctypes
import unittest

from prefixes import l_targets, prefix


class Truncation(unittest.TestCase):
    def check(self, sdk, daemon, image_of, size_of):
        handles = [sdk.BVTSonar_Create() for _ in range(2000)]  # ints, not pointers
        self.assertTrue(all(0 < h < 2**31 for h in handles))
        self.assertEqual(len(set(handles)), len(handles))
        for h in handles[1:]:
            sdk.BVTSonar_Destroy(h)
        sonar, head, ping, image = handles[0], ctypes.c_int(), ctypes.c_int(), ctypes.c_int()
        # The library writes 8 bytes, so each handle gets 8 bytes.
        head, ping, image = (ctypes.c_longlong() for _ in range(3))
        self.assertEqual(sdk.BVTSonar_Open(sonar, b"NET", daemon.address.encode()), 0)
        self.assertEqual(sdk.BVTSonar_GetHead(sonar, 0, ctypes.byref(head)), 0)
        self.assertEqual(sdk.BVTHead_GetPing(head.value, -1, ctypes.byref(ping)), 0)
        self.assertEqual(image_of(ping.value, ctypes.byref(image)), 0)
        self.assertGreater(size_of(image.value), 100)
        sdk.BVTMagImage_Destroy(image.value)
        sdk.BVTPing_Destroy(ping.value)
        sdk.BVTPing_Destroy(ping.value)  # stale: no error
        self.assertEqual(image_of(ping.value, ctypes.byref(image)), 7)
        self.assertEqual(image.value, 0)
        self.assertEqual(sdk.BVTHead_GetPing(sonar, -1, ctypes.byref(ping)), 7)  # a handle of another type
        self.assertEqual(sdk.BVTHead_GetPing(-1, -1, ctypes.byref(ping)), 7)
        sdk.BVTSonar_Destroy(sonar)

    def test_truncated_handles_work_in_both_interfaces(self):
        with l_targets() as daemon:
            three = ctypes.CDLL(prefix(3) / "lib/libbvtsdk.so.3")
            self.check(three, daemon, three.BVTPing_GetImage, three.BVTMagImage_GetHeight)
            four = ctypes.CDLL(prefix(4) / "lib/libbvtsdk.so.4")

            def height(image):
                out = ctypes.c_int()
                self.assertEqual(four.BVTMagImage_GetHeight(image, ctypes.byref(out)), 0)
                return out.value

            self.check(four, daemon, four.BVTPing_GetImage, height)


if __name__ == "__main__":
    unittest.main()
