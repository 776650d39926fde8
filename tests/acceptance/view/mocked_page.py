"""The page of the live view in a real browser, with a scripted daemon (mock_daemon.py) that has pings of sonard."""
import pathlib
import tempfile

from browser import Browser
from page_checks import PAGE, PageChecks
from running_sonard import Sonard

from sonard_client import OculusClient  # pylint: disable=wrong-import-order

MOUNT = "{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}"


def ping_about(ping, full_scale=254):
    """Converts a ping of the Python client for the mock: (samples, description)."""
    rows, beams = ping.samples.shape
    return ping.samples.tobytes(), {
        "settings": {"rows": rows, "beams": beams, "max_code": full_scale}, "row_spacing_m": ping.row_m,
        "beam_azimuth_rad": [float(a) for a in ping.azimuths_rad],
        "vehicle_in_world": {"wxyz": [1, 0, 0, 0], "xyz_m": [-7, 0, -3]}}


class MockedPage(PageChecks):
    """Methods for a TestCase."""

    @classmethod
    def setUpClass(cls):
        from mock_daemon import MockDaemon  # pylint: disable=import-outside-toplevel
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.pings, cls.raw = {}, {}
        with Sonard(mount=MOUNT) as daemon:
            for name, settings in {"60 degrees, 8 bit": {}, "60 degrees, 16 bit": {"bits": 16}, "130 degrees, 8 bit": {"mode": 1}}.items():
                with OculusClient(daemon.address) as sonar:
                    sonar.fire(rate_hz=5, range_m=10 if "mode" not in settings else 20, **settings)
                    ping = sonar.ping(90)
                cls.pings[name] = ping_about(ping)
                cls.raw[name] = pathlib.Path(cls.folder.name) / name.replace(" ", "-")
                cls.raw[name].write_bytes(ping.data)
        cls.mock = MockDaemon(PAGE, [cls.pings["60 degrees, 8 bit"]]).start()
        cls.addClassCleanup(cls.mock.stop)
        cls.url = f"http://127.0.0.1:{cls.mock.port}/"
        cls.browser = cls.enterClassContext(Browser())

    def setUp(self):
        self.mock.token = ""
        self.mock.pings = [self.pings["60 degrees, 8 bit"]]
        self.mock.state("fine")

    def open(self, width=1440, height=900, query="", **options):
        return self.opened(self.browser.open(self.url + query, width, height, **options))
