"""Tests the page of the live view in a real browser, with sonard and a driver. It is skipped without browser or page.

SONARD_SHOTS names a folder for pictures; without it only pictures of failed tests are kept. SONARD_SHOT_HZ sets the ping
rate for the pictures, for slow computers.
"""
import collections
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "view"))

from browser import Browser  # noqa: E402
from page_checks import WHY_NOT, PageChecks, shown  # noqa: E402
from running_sonard import BUILD, ROOT, Sonard  # noqa: E402

from sonard_client import OculusClient  # noqa: E402  pylint: disable=wrong-import-order

MOUNT = "{frame: FRD, xyz_m: [0.3, 0, 0.1], rpy_deg: [0, -15, 0]}"
RATE_HZ = int(os.environ.get("SONARD_SHOT_HZ", 10))
SEEN_AT = """requestAnimationFrame(function look() {
  if (/\\d/.test(document.querySelector('#ping-number')?.textContent)) window.seenAt = performance.now();
  else requestAnimationFrame(look);
})"""

# The requests of the page, each with its time; `painted` is true if the page had painted a ping by then.
SENT = """window.sent = []; WebSocket.prototype.send = ((old) => function (data) {
  if (typeof data === 'string') window.sent.push({ at: performance.now(), painted: /\\d/.test(document.querySelector('#ping-number').textContent), word: JSON.parse(data) });
  return old.call(this, data);
})(WebSocket.prototype.send)"""


class Driver(threading.Thread):
    """Requests and reads pings at a limited rate, and stores the last ones by number. It connects again after a lost
    connection."""

    def __init__(self, address, reads_hz=1000.0, **settings):
        super().__init__(daemon=True)
        self.address, self.reads_hz, self.settings = address, reads_hz, settings
        self.over, self.read, self.pings = threading.Event(), 0, collections.OrderedDict()

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.join(20)

    def run(self):
        while not self.over.is_set():
            try:
                with OculusClient(self.address) as sonar:
                    sonar.fire(**self.settings)
                    self.store_pings(sonar)
            except OSError:
                self.over.wait(0.2)

    def store_pings(self, sonar):
        due = time.monotonic()
        while not self.over.is_set():
            try:
                ping = sonar.ping(0.5)
            except TimeoutError:
                continue
            self.read += 1
            self.pings[ping.number] = ping.data
            if len(self.pings) > 300:
                self.pings.popitem(last=False)
            due = max(due + 1 / self.reads_hz, time.monotonic() - 1 / self.reads_hz)
            self.over.wait(max(0, due - time.monotonic()))


def url_of(daemon):
    return f"http://{daemon.address}:8088/"


def ask(daemon, path, body=None):
    request = urllib.request.Request(url_of(daemon) + "api/v1/" + path, data=None if body is None else json.dumps(body).encode(),
                                     headers={"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=30) as answer:
        return json.load(answer)


def client_of(daemon):
    return ask(daemon, "status")["sonars"][0]["clients"][0]


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Live(PageChecks, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = cls.enterClassContext(Browser())

    def open(self, daemon, width=1440, height=900, query="", **options):
        return self.opened(self.browser.open(url_of(daemon) + query, width, height, **options))

    def test_fan_equals_that_of_sonarctl_view(self):
        """The page draws a ping as `sonarctl view` draws the bytes that a driver received."""
        for settings, width in (({}, 1000), ({"bits": 16}, 300), ({"mode": 1, "range_m": 20}, 300)):
            with self.subTest(**settings), Sonard(mount=MOUNT, trajectory="orbit", arguments=["--clock", "stepped"]) as daemon, \
                    tempfile.TemporaryDirectory() as folder:
                page = self.open(daemon, 1100, 700, f"?test={width}")
                page.wait("sonardTest.connection.subscriptions.size > 5")
                with Driver(daemon.address, reads_hz=10, **settings) as driver:
                    shown(page)
                    page.wait("sonardTest.fan.ping?.number > 2 && sonardTest.fan.toggleFreeze()")
                    number = page.run("sonardTest.fan.ping.number")
                    deadline = time.monotonic() + 200
                    while number not in driver.pings and time.monotonic() < deadline:
                        time.sleep(0.1)
                raw = pathlib.Path(folder) / "ping"
                raw.write_bytes(driver.pings[number])
                self.compare(self.drawn(page, "copper"), self.reference(raw, "copper", width))
                page.close()

    def test_first_picture_comes_within_a_second(self):
        """Checks the time to open the page; the best of several tries, because other programs run too."""
        with Sonard(mount=MOUNT, trajectory="orbit") as daemon, Driver(daemon.address) as driver:
            self.patiently(lambda: driver.read > 5)
            best = 1e9
            for _ in range(8):
                page = self.open(daemon, script=SEEN_AT)
                best = min(best, page.wait("window.seenAt"))
                self.assert_quiet(page, url_of(daemon))
                page.close()
                if best < 1000:
                    break
            print(f"\n  first picture after {best:.0f} ms", end="", file=sys.stderr)
            if best >= 1000:
                self.skip_beside_busy_programs()
            self.assertLess(best, 1000)

    def test_the_scene_waits_for_the_first_picture(self):
        with Sonard(mount=MOUNT, trajectory="orbit") as daemon, Driver(daemon.address) as driver:
            self.patiently(lambda: driver.read > 1)
            page = self.open(daemon, query="?test=640", script=SENT)
            page.wait("sonardTest.scene?.objects.size > 0")
            asked = page.run("window.sent.filter(({word}) => word.op === 'subscribe' && word.subscriptions.some((s) => "
                             "s.channelId === sonardTest.connection.byTopic.get('/scene').id))")
            self.assertEqual(len(asked), 1)
            self.assertTrue(asked[0]["painted"] or asked[0]["at"] > 10_000, asked)

    def skip_beside_busy_programs(self):
        if os.getloadavg()[0] > 1.5 * os.cpu_count():
            self.skipTest(f"other programs keep the processors busy: load {os.getloadavg()[0]:.1f}")

    def test_numbers_are_true(self):
        """A driver that reads at 7 Hz is shown with 7 Hz, and with the dropped pings of the status."""
        with Sonard(scene="tank-rod.yaml", pose="{frame: ENU_FLU, xyz_m: [-0.4, 0, -0.61]}") as daemon, \
                Driver(daemon.address, reads_hz=7, rate_hz=15, range_m=1, beams=256):
            page = self.open(daemon)
            cell = "Number(document.querySelector('#clients td:nth-child(%d)').innerText.replace(/[^\\d.]/g, ''))"
            before = client_of(daemon)
            page.wait(f"{cell % 2} > 0 && {cell % 3} > 0")
            rate, mbit, dropped = page.run(f"[{cell % 2}, {cell % 3}, {cell % 4}]")
            after = client_of(daemon)
            bytes_each = int(after["bytes_written"]) / int(after["pings_written"])
            self.assertAlmostEqual(mbit, 8e-6 * rate * bytes_each, delta=0.3)
            self.assertTrue(int(before.get("pings_dropped", 0)) <= dropped <= int(after.get("pings_dropped", 0)), (before, dropped, after))
            try:
                page.wait(f"{cell % 4} > 0", 90)
                self.expect_seven_hz(page, daemon, cell)
            except AssertionError:
                self.skip_beside_busy_programs()  # beside them the driver may get fewer than 7 pings a second
                raise

    def expect_seven_hz(self, page, daemon, cell):
        page.wait(f"Math.abs({cell % 2} - 7) <= 0.3", 60)
        # Pings are sent in bursts while the kernel's buffers drain, so means over ten seconds are used.
        written, shown_hz = [], []
        for _ in range(50):
            written.append((time.monotonic(), int(client_of(daemon)["pings_written"])))
            shown_hz.append(page.run(cell % 2))
            time.sleep(0.2)
        hz = (written[-1][1] - written[0][1]) / (written[-1][0] - written[0][0])
        self.assertAlmostEqual(sum(shown_hz) / len(shown_hz), 7, delta=0.3)
        self.assertAlmostEqual(hz, 7, delta=0.6)

    def test_the_page_outlives_the_daemon(self):
        """The picture usually returns within 10 s of a restart; the limit of 200 s is for busy machines."""
        with Sonard(mount=MOUNT, trajectory="orbit") as daemon, Driver(daemon.address):
            page = self.open(daemon, query="?test=300")
            shown(page)
            daemon.stop()
            page.wait("document.querySelector('#notice-text').innerText.includes('sonard has not answered for')")
            daemon.restart()
            begin = time.monotonic()
            page.wait("sonardTest.facts.connection === 'open' && performance.now() / 1000 - sonardTest.facts.ping?.at < 1")
            took_s = time.monotonic() - begin
            print(f"\n  picture back after {took_s:.1f} s", end="", file=sys.stderr)
            self.assertLess(took_s, 200)

    def test_another_scene_replaces_the_meshes(self):
        with Sonard(mount=MOUNT, trajectory="orbit") as daemon, Driver(daemon.address):
            page = self.open(daemon, query="?test=300")
            page.wait("sonardTest.scene.objects.has('wreck')")
            triangles = page.run("sonardTest.scene.objects.get('bed').children[0].geometry.index.count / 3")
            self.assertTrue(10_000 < triangles < 30_000, f"{triangles} of 109552, because there is no graphics processor")
            ask(daemon, "load", {"path": self.tube(daemon.folder.name)})
            page.wait("sonardTest.scene.objects.has('tube')")
            triangles = page.run("sonardTest.scene.objects.get('tube').children[0].geometry.index.count / 3")
            self.assertTrue(2_000 < triangles < 30_000, f"{triangles} of 32000 of a long thin mesh")
            ask(daemon, "load", {"path": str(ROOT / "scenes/demo.yaml")})
            page.wait("sonardTest.scene.objects.has('tyre')")
            page.press_mouse("[data-camera=top]")
            self.assertEqual(page.run("sonardTest.scene.restUntil"), 0, "drawn at once")
            ask(daemon, "set_object", {"object": "tyre", "visible": False})
            page.wait("!sonardTest.scene.objects.has('tyre')")
            ask(daemon, "load", {"path": str(ROOT / "scenes/tank-rod.yaml")})
            page.wait("[...sonardTest.scene.objects.keys()].sort().join() === 'rod,tank'")

    @staticmethod
    def tube(folder):
        """Writes a scene with a tube of 20 m, 2 cm wide, of 32000 triangles."""
        around, rings = 16, 1001
        places = [(0.02 * i, 0.01 * math.cos(math.tau * k / around), 0.01 * math.sin(math.tau * k / around))
                  for i in range(rings) for k in range(around)]
        text = "".join(f"v {x:.4f} {y:.6f} {z:.6f}\n" for x, y, z in places)
        for i in range(rings - 1):
            for k in range(around):
                a, b = around * i + k + 1, around * i + (k + 1) % around + 1
                text += f"f {a} {b} {b + around}\nf {a} {b + around} {a + around}\n"
        scene = pathlib.Path(folder, "tube.yaml")
        scene.with_suffix(".obj").write_text(text, encoding="utf-8")
        scene.write_text("name: tube\nmaterials: {steel: {like: steel}}\nobjects:\n"
                         "  - {name: tube, type: mesh, file: tube.obj, material: steel, pose: {xyz_m: [0, 0, -5]}}\n", encoding="utf-8")
        return str(scene)

    def test_the_page_steers(self):
        """Tests a setting, a fault and its end, the trajectory, standby and its button."""
        with Sonard(mount=MOUNT, trajectory=str(self.circle()), arguments=["--faults"]) as daemon, Driver(daemon.address):
            page = self.open(daemon, query="?test=300")
            shown(page)
            field = "document.querySelector('[name=\"/front/range_m\"]')"
            page.wait(f"!!{field}")
            page.run(f"((f) => {{ f.value = '7'; f.dispatchEvent(new Event('change')); }})({field})")
            self.patiently(lambda: ask(daemon, "status")["sonars"][0]["range_m"] == 7)
            page.wait("document.querySelector('#asked-by').innerText === 'last changed by a page'")
            page.wait("document.querySelector('#timeline').offsetWidth > 0")
            page.press(" ")
            self.patiently(lambda: ask(daemon, "status")["vehicles"][0]["trajectory"].get("paused"))
            page.wait("!!" + self.trouble("Deaf head"))
            page.run(f"document.querySelector('#fault-seconds').value = 60, {self.trouble('Deaf head')}.click()")
            page.wait("document.querySelector('.fault-card .left')?.innerText.startsWith('0:') && document.querySelector('#fan-pane').matches('.faulty')")
            self.assertEqual(page.text("#fault-count"), "1")
            page.wait("document.querySelector('.fault-card progress').value < 0.97")
            page.wait("sonardTest.facts.findings?.some((f) => f.check === 'fault' && f.level > 0)")
            page.wait("document.querySelector('#announce').textContent.includes('fault: Deaf head')")
            time.sleep(2.5)  # screen readers get changes at most every 2 s
            announced = page.run("document.querySelector('#announce').textContent")
            self.assertNotIn("A fault acts", announced, "the finding already names the fault")
            page.click("#findings button.link")
            page.wait("!document.querySelector('.fault-card')")
            self.assertNotIn("A fault acts", page.text("#findings"), "the page does not wait for the daemon's next check")
            ask(daemon, "sonar", {"rate_hz": 0})
            page.wait("document.body.dataset.situation === 'standby'")
            page.click("#notice-button")
            page.wait("document.body.dataset.situation === 'fine'")
            self.assert_quiet(page, url_of(daemon))

    def test_a_scan_has_lines_a_second(self):
        with Sonard(profile="ping360", mount="{frame: FLU, xyz_m: [0, 0, 0]}") as daemon:
            page = self.open(daemon)
            page.wait("document.body.dataset.situation === 'no-client'")
            page.click("#notice-button")
            page.wait("/^[1-9]\\d*\\.\\d lines\\/s$/.test(document.querySelector('#rate').innerText) && document.querySelector('#measured').innerText.endsWith(' lines/s')")
            self.assertIsNone(page.run("document.querySelector('[name=\"/front/rate_hz\"]')"), "its host sets the rate")
            self.assertNotIn("1000", page.text("#settings"))
            self.assert_quiet(page, url_of(daemon))

    def test_the_page_records(self):
        with Sonard(mount=MOUNT, more="recording: {folder: .}") as daemon, Driver(daemon.address, range_m=2, beams=256):
            page = self.open(daemon)
            shown(page)
            page.run("document.querySelector('#record').focus()")
            page.press("Enter")
            page.wait("document.querySelector('#record').innerText === 'Stop recording' && /running/.test(document.querySelector('#recordings').innerText)")
            self.patiently(lambda: int(ask(daemon, "status")["recordings"][0].get("pings", 0)) > 2)
            page.run("document.querySelector('#record').focus()")
            page.press("Enter")
            page.wait("document.querySelector('#record').innerText === 'Record' && !/running/.test(document.querySelector('#recordings').innerText)")
            (recorded,) = pathlib.Path(daemon.folder.name).glob("front-*.mcap")
            self.assertIn(recorded.name, page.text("#recordings"))
            self.assert_quiet(page, url_of(daemon))

    def test_without_a_folder_the_page_says_why_it_does_not_record(self):
        with Sonard(mount=MOUNT) as daemon:
            page = self.open(daemon)
            page.wait("document.querySelector('#record')?.disabled === false")
            page.run("document.querySelector('#record').focus()")
            page.press("Enter")
            page.wait("document.querySelector('#refusal').offsetWidth > 0")
            self.assertIn("recording: {folder: DIR}", page.text("#refusal"))

    def test_all_parts_work_at_once(self):
        """There are two drivers, one of them slow, a trajectory and a fault, so that all panels have content."""
        trajectory = f"{{file: {self.circle()}, loop: true}}"
        with Sonard(mount=MOUNT, trajectory=trajectory, arguments=["--faults", "--clients", "2"]) as daemon, \
                Driver(daemon.address, rate_hz=RATE_HZ), Driver(daemon.address, reads_hz=0.7 * RATE_HZ, rate_hz=RATE_HZ):
            for width, height, name in ((1440, 900, "live-view"), (390, 844, "live-view-phone")):
                page = self.open(daemon, width, height, touch=width < 800)
                shown(page)
                page.wait("document.querySelectorAll('#clients tr').length === 3")
                if width > 800:
                    page.wait("!!" + self.trouble("Thin tether"))
                    page.run(f"document.querySelector('#fault-seconds').value = 60, {self.trouble('Thin tether')}.click()")
                    page.wait("/thin.tether/i.test(document.querySelector('#findings li')?.innerText)")
                self.picture(page, name, 8 if width > 800 else 0)
                self.assert_quiet(page, url_of(daemon))
                page.close()

    @staticmethod
    def trouble(name):
        return f"document.querySelector('[data-trouble={name.lower().replace(' ', '_')}]')"

    def circle(self):
        """Writes a trajectory file: a circle around the middle of the demo's scene in 90 s, with the bow towards the middle."""
        path = self.scratch() / "survey.csv"
        rows = []
        for n in range(901):
            turn = 2 * math.pi * n / 900
            heading = turn + math.pi - 0.35
            rows.append(f"{n / 10},{7 * math.cos(turn):.4f},{7 * math.sin(turn):.4f},-3,{math.cos(heading / 2):.6f},0,0,{math.sin(heading / 2):.6f}\n")
        path.write_text("# frame: ENU_FLU\nt,x,y,z,qw,qx,qy,qz\n" + "".join(rows))
        return path

    def scratch(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        return pathlib.Path(folder.name)

    def test_the_page_does_not_scroll_sideways(self):
        with Sonard(mount=MOUNT, trajectory="orbit", arguments=["--faults"]) as daemon, Driver(daemon.address):
            for width, height in ((320, 640), (390, 844), (768, 1024), (1440, 900), (2560, 1440)):
                with self.subTest(width=width):
                    page = self.open(daemon, width, height, touch=width < 800)
                    shown(page)
                    self.assert_fits(page, width, "live-")
                    page.close()

    def test_axe_finds_nothing_serious(self):
        """Tests the page as it opens, and after use: with a fault, a refused setting, a frozen picture and the help."""
        axe = self.axe()
        with Sonard(mount=MOUNT, trajectory="orbit", arguments=["--faults"]) as daemon, Driver(daemon.address):
            for theme in ("dark", "light"):
                for width, height in ((1440, 900), (390, 844)):
                    with self.subTest(theme=theme, width=width):
                        page = self.open(daemon, width, height, touch=width < 800, theme=theme)
                        shown(page)
                        for tab in ("fan",) if width > 800 else ("fan", "clients", "faults", "log"):
                            page.run(f"document.querySelector('#tabs [data-tab={tab}]').click()")
                            self.assertEqual(self.serious(page, axe), [], tab)
                        self.use(page)
                        self.assertEqual(self.serious(page, axe), [], "used")
                        for tab in () if width > 800 else ("fan", "clients", "faults"):
                            page.run(f"document.querySelector('#tabs [data-tab={tab}]').click()")
                            self.assertEqual(self.serious(page, axe), [], f"used, {tab}")
                        page.press("?")
                        self.assertEqual(self.serious(page, axe), [], "with the help")
                        page.close()

    def use(self, page):
        """Makes hidden elements visible. A click hides a refusal, so the refusal comes last."""
        page.run("document.querySelector('#freeze').click()")
        page.wait("document.querySelector('#freeze').textContent === 'Go on'")
        page.wait("!!" + self.trouble("Thin tether"))
        page.run(f"{self.trouble('Thin tether')}.click()")
        page.wait("!!document.querySelector('.fault-card')")
        field = "document.querySelector('[name=\"/front/range_m\"]')"
        page.wait(f"!!{field}")
        page.run(f"((f) => {{ f.focus(); f.value = '999'; f.dispatchEvent(new Event('change')); f.blur(); }})({field})")
        page.wait("!document.querySelector('#refusal').hidden")

    @staticmethod
    def serious(page, axe):
        page.run(axe + "; 0")
        found = page.run("axe.run(document, {resultTypes: ['violations']}).then((r) => r.violations.filter((v) => "
                         "['serious', 'critical'].includes(v.impact)).map((v) => `${v.id}: ${v.nodes.map((n) => n.html.slice(0, 90))}`))")
        return found

    def axe(self):
        """Returns the text of axe-core, which npm installs into the build folder with the versions of view/npm."""
        folder = BUILD / "tests/page-npm"
        if shutil.which("npm") is None:
            self.skipTest("no npm")
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("package.json", "package-lock.json", ".npmrc"):
            shutil.copy(ROOT / "tests/acceptance/view/npm" / name, folder)
        done = subprocess.run(["npm", "ci", "--ignore-scripts", "--prefer-offline", "--fetch-retries=0"], cwd=folder, capture_output=True,
                              text=True, timeout=120, check=False)
        if done.returncode != 0:
            self.skipTest("npm cannot get axe-core: " + done.stderr.strip().splitlines()[-1])
        return (folder / "node_modules/axe-core/axe.min.js").read_text(encoding="utf-8")


if __name__ == "__main__":
    unittest.main()
