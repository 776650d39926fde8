"""Tests sonars with two heads, with strict head numbers and strict ranges, and with packed pings, through the 4.x library. Also
tests the settings in their recordings, and the number of ranges."""
import ctypes
import pathlib
import tempfile
import unittest

from prefixes import Sonard, prefix

SUCCESS, NO_HEAD, BAD_RANGE = 0, 2010, 4009


class Heads(unittest.TestCase):
    def sonar(self, profile, options, heading_deg=0):
        daemon = Sonard(scene="l-targets.yaml", profile=profile,
                        pose="{frame: ENU_FLU, xyz_m: [0, 0, 0], rpy_deg: [0, 0, %g]}" % heading_deg,
                        mount="{frame: FLU, xyz_m: [0, 0, 0]}\n    options: {" + options + "}")
        self.enterContext(daemon)
        self.sdk = ctypes.CDLL(prefix(4) / "lib/libbvtsdk.so.4")
        sonar = self.sdk.BVTSonar_Create()  # an int is sufficient: see ctypes_truncation_test.py
        self.addCleanup(self.sdk.BVTSonar_Destroy, sonar)
        self.assertEqual(self.sdk.BVTSonar_Open(sonar, b"NET", daemon.address.encode()), SUCCESS)
        return sonar

    def head(self, sonar, number):
        """Returns the code and the handle."""
        out = ctypes.c_longlong()
        return self.sdk.BVTSonar_GetHead(sonar, number, ctypes.byref(out)), out.value

    def number(self, function, head, kind):
        out = kind()
        self.assertEqual(function(head, ctypes.byref(out)), SUCCESS)
        return out.value

    def ping_works(self, head):
        ping = ctypes.c_longlong()
        self.assertEqual(self.sdk.BVTHead_GetPing(head, -1, ctypes.byref(ping)), SUCCESS)
        self.sdk.BVTPing_Destroy(ping.value)

    def set_range(self, head, start, stop):
        return self.sdk.BVTHead_SetRange(head, ctypes.c_float(start), ctypes.c_float(stop))

    def gain(self, head):
        return self.number(self.sdk.BVTHead_GetGainAdjustment, head, ctypes.c_float)

    def test_two_heads_have_their_own_frequencies_and_ranges(self):
        sonar = self.sonar("blueview-m900-2250-130", "compression: deflate")
        self.assertEqual(self.number(self.sdk.BVTSonar_GetHeadCount, sonar, ctypes.c_int), 2)
        for number, hertz, longest in ((0, 900000, 100), (1, 2250000, 10)):
            code, head = self.head(sonar, number)
            self.assertEqual(code, SUCCESS)
            self.assertEqual(self.number(self.sdk.BVTHead_GetCenterFreq, head, ctypes.c_int), hertz)
            self.assertEqual(self.set_range(head, 0, 500), SUCCESS)  # moved into the limits of the head
            self.assertEqual(self.number(self.sdk.BVTHead_GetStopRange, head, ctypes.c_float), longest)
            self.set_range(head, 1, 5)
            self.ping_works(head)
        self.assertEqual(self.head(sonar, 2), (NO_HEAD, 0))

    def ranges(self, head, threshold=None):
        """Returns how many bearings of a new ping have a range, and how many there are; threshold None: the library's default."""
        generator, ping, profile = self.sdk.BVTImageGenerator_Create(), ctypes.c_longlong(), ctypes.c_longlong()
        self.assertEqual(self.sdk.BVTImageGenerator_SetHead(generator, head), SUCCESS)
        if threshold is not None:
            self.assertEqual(self.sdk.BVTImageGenerator_SetRangeProfileIntensityThreshold(generator, threshold), SUCCESS)
        self.assertEqual(self.sdk.BVTHead_GetPing(head, -1, ctypes.byref(ping)), SUCCESS)
        self.assertEqual(self.sdk.BVTImageGenerator_GetRangeProfile(generator, ping.value, ctypes.byref(profile)), SUCCESS)
        counts = [self.number(count, profile.value, ctypes.c_int)
                  for count in (self.sdk.BVTRangeProfile_GetValidCount, self.sdk.BVTRangeProfile_GetCount)]
        self.sdk.BVTRangeProfile_Destroy(profile.value)
        self.sdk.BVTPing_Destroy(ping.value)
        self.sdk.BVTImageGenerator_Destroy(generator)
        return counts

    def test_empty_water_has_no_ranges(self):
        sonar = self.sonar("blueview-p900-90", "compression: none", heading_deg=180)
        _, head = self.head(sonar, 0)
        self.assertEqual(self.set_range(head, 1, 60), SUCCESS)  # where noise is strongest
        self.assertEqual(self.ranges(head), [0, 512])
        self.assertEqual(self.ranges(head, threshold=0), [512, 512])

    def test_targets_have_ranges(self):
        sonar = self.sonar("blueview-p900-90", "compression: none")
        _, head = self.head(sonar, 0)
        self.assertEqual(self.set_range(head, 1, 9), SUCCESS)
        found, beams = self.ranges(head)
        self.assertGreater(found, 3)
        self.assertLess(found, beams / 2)

    def test_a_recording_has_the_settings_of_its_pings(self):
        sonar = self.sonar("blueview-p900-90", "compression: none")
        _, head = self.head(sonar, 0)
        folder = self.enterContext(tempfile.TemporaryDirectory())
        file = str(pathlib.Path(folder) / "dive.son").encode()
        recording = self.sdk.BVTSonar_Create()
        self.set_range(head, 1, 5)
        self.sdk.BVTHead_SetSoundSpeed(head, 1490)
        self.assertEqual(self.sdk.BVTSonar_CreateFile(recording, file, sonar, b""), SUCCESS)
        _, recorded = self.head(recording, 0)
        self.assertEqual(self.number(self.sdk.BVTHead_GetSoundSpeed, recorded, ctypes.c_int), 1490)  # not the initial value
        for gain in (-6, -6, 3):
            self.assertEqual(self.sdk.BVTHead_SetGainAdjustment(head, ctypes.c_float(gain)), SUCCESS)
            ping = ctypes.c_longlong()
            self.assertEqual(self.sdk.BVTHead_GetPing(head, -1, ctypes.byref(ping)), SUCCESS)
            self.assertEqual(self.sdk.BVTHead_PutPing(recorded, ping.value), SUCCESS)
            self.sdk.BVTPing_Destroy(ping.value)
        self.sdk.BVTSonar_Destroy(recording)
        player = self.sdk.BVTSonar_Create()
        self.assertEqual(self.sdk.BVTSonar_Open(player, b"FILE", file), SUCCESS)
        _, played = self.head(player, 0)
        self.assertEqual(self.gain(played), -6)  # the gain of the first ping
        for wanted in (-6, -6, 3):
            self.ping_works(played)
            self.assertEqual(self.gain(played), wanted)
        self.assertEqual(self.number(self.sdk.BVTHead_GetStopRange, played, ctypes.c_float), 5)
        self.assertEqual(self.number(self.sdk.BVTHead_GetSoundSpeed, played, ctypes.c_int), 1490)
        self.sdk.BVTSonar_Destroy(player)

    def test_strict_numbers_and_ranges(self):
        sonar = self.sonar("blueview-p900-90", "heads_base: strict, strict_range: on")
        self.assertEqual(self.head(sonar, 1), (NO_HEAD, 0))
        code, head = self.head(sonar, 0)
        self.assertEqual(code, SUCCESS)
        self.assertEqual(self.set_range(head, 1, 5), SUCCESS)
        self.assertEqual(self.set_range(head, 0, 500), BAD_RANGE)
        self.assertEqual(self.number(self.sdk.BVTHead_GetStopRange, head, ctypes.c_float), 5)
        self.ping_works(head)

    def test_one_head_may_be_numbered_from_one(self):
        sonar = self.sonar("blueview-p900-90", "heads_base: 1")
        for number in (0, 1):
            code, head = self.head(sonar, number)
            self.assertEqual(code, SUCCESS)
            self.assertEqual(self.set_range(head, 1, 5), SUCCESS)
            self.ping_works(head)


if __name__ == "__main__":
    unittest.main()
