"""Tests the demos: each shows echoes in its preview. The preview stops for a driver and resumes after it.
On the page, nothing covers the product's kind of picture, and the Tab key reaches all controls.

The tests of the page are skipped without browser or page. SONARD_SHOTS names a folder for pictures.
"""
import pathlib
import re
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "view"))

from browser import Browser  # noqa: E402
from foxglove_viewer import Viewer  # noqa: E402
from page_checks import LACKING_PX, WHY_NOT, WITHOUT_WEBGL, PageChecks, shown  # noqa: E402
from running_sonard import ROOT, SONARCTL, SONARD, Daemon, eventually, run  # noqa: E402

HTTP, SONAR = "127.0.0.1", "127.0.0.2"
# For each demo: its picture, the number of pings to examine (a quarter of the circle of a sweep), and the port of its driver.
DEMOS = {"oculus": ("fan", 1, 52100), "blueview": ("fan", 1, 14750), "aris": ("fan", 1, 56888), "3d15": ("range image", 1, 80),
         "ping360": ("sweep", 100, 12345), "surveyor": ("points", 1, 62312), "omniscan": ("waterfall", 20, 51200),
         "ping1d": ("waterfall", 20, 9090), "s500": ("waterfall", 20, 51200), "dvl": ("waterfall", 20, 16171), "m3": ("fan", 1, 20001),
         "micron": ("sweep", 100, 4001), "norbit": ("points", 1, 2210)}
MOST_NOISE = 0.95        # this fraction of the noise samples lies below the limit of an echo
LEAST_ECHOES = 0.2

# True if nothing covers the middle of the picture.
UNCOVERED = """(() => {
  const canvas = [...document.querySelectorAll('#fan, #drawn')].find((c) => c.offsetWidth);
  const box = canvas.getBoundingClientRect();
  return [0.3, 0.5, 0.7].every((part) => {
    const over = document.elementFromPoint(box.left + box.width / 2, box.top + part * box.height);
    return over?.closest('#fan-glass');
  }) && !document.querySelector('#notice').offsetWidth;
})()"""
NAME = "((e) => e.id || e.name || e.dataset.trouble || e.dataset.tab || e.className + e.textContent)"
# The names of the controls that are usable now.
CONTROLS = f"""[...document.querySelectorAll('button, select, input, summary, [tabindex="0"]')]
  .filter((e) => e.offsetWidth && !e.disabled && e.tabIndex >= 0).map({NAME})"""
# Records the controls that get the focus from now on.
NOTE_FOCUSED = f"""window.reached = new Set(), document.activeElement.blur(),
  window.noteFocused ??= (addEventListener('focusin', (e) => window.reached.add({NAME}(e.target))), true)"""
REACHED = "[...window.reached]"


# Notes the words that are on the canvas of the marks now, with the middle of each.
NOTE_WORDS = """window.words = new Map();
{
  const { clearRect, fillText: write } = CanvasRenderingContext2D.prototype;
  CanvasRenderingContext2D.prototype.clearRect = function (...box) {
    if (this.canvas.id === 'fan-marks') window.words.clear();
    clearRect.apply(this, box);
  };
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const half = this.measureText(text).width / 2;
    window.words.set(text, [x + (this.textAlign === 'left' ? half : 0), y - 4, half]);
    write.call(this, text, x, y);
  };
}"""
# The range labels of which a corner lies in the picture that sonard has drawn; undefined until labels are written.
LABELS_INSIDE = """(() => {
  const picture = document.querySelector('#drawn');
  const labels = [...window.words].filter(([text]) => / m$/.test(text));
  if (!labels.length || !picture.offsetWidth) return undefined;
  const copy = Object.assign(document.createElement('canvas'), { width: picture.offsetWidth, height: picture.offsetHeight }).getContext('2d');
  copy.drawImage(picture, 0, 0, picture.offsetWidth, picture.offsetHeight);
  const colour = (x, y) => copy.getImageData(x, y, 1, 1).data.join();
  const outside = [colour(0, 0), '0,0,0,0'];  // beside the canvas nothing is drawn
  return labels.filter(([, [x, y, half]]) => [[-half, -4], [half, -4], [-half, 4], [half, 4]].some(([dx, dy]) =>
    !outside.includes(colour(x + dx - picture.offsetLeft, y + dy - picture.offsetTop)))).map(([text]) => text).join() || 'none';
})()"""


def demo(maker):
    return Daemon(None, str(SONARD), [maker])


def product_of(daemon):
    """Returns the name of the product that sonard prints when it starts."""
    return re.search(r"^sonar +front +(.+?)  ", daemon.log(), re.MULTILINE).group(1)


def rows_of(image):
    """Returns the pixels of a RawImage, as lists of numbers."""
    size = {"mono8": 1, "mono16": 2, "32FC1": 4}[image["encoding"]]
    data, step = image["data"], image["step"]
    values = list(data) if size == 1 else [int.from_bytes(data[i:i + size], "little") for i in range(0, len(data), size)]
    return [values[i:i + step // size] for i in range(0, len(values), step // size)]


def echoes(rows, noise):
    """Returns the fraction of the samples that exceed the noise at their range."""
    loudest = [sorted(row)[int(MOST_NOISE * (len(row) - 1))] for row in noise]
    return sum(v > most for row, most in zip(rows, loudest) for v in row) / sum(len(row) for row in rows)


def rows_seen(viewer, pings):
    """Returns the samples of the next pings, grouped by range."""
    images, begin_ns = [], time.time_ns()
    while len(images) < pings:
        topic, ns, data = viewer.wait_for(lambda kind, _: kind == "message")
        if topic == "/front/image" and ns > begin_ns:
            images.append(rows_of(viewer.decode(topic, data)))
    return [[v for row in rows for v in row] for rows in zip(*images)]


def transmit(word):
    done = run(SONARCTL, "set", "sonar", "front", "--transmit", word)
    assert done.returncode == 0, done.stderr


class Preview(unittest.TestCase):
    def test_the_example_of_an_aris_shows_echoes_too(self):
        with Daemon(ROOT / "scenes/sonard-aris.yaml", str(SONARD)), Viewer(HTTP) as viewer:
            viewer.greeted().subscribe("/front/image")
            viewer.say(op="setParameters", parameters=[{"name": "/front/preview", "value": True}], id="preview")
            seen = rows_seen(viewer, 1)
            transmit("off")
            self.assertGreater(echoes(seen, rows_seen(viewer, 1)), LEAST_ECHOES)

    def test_a_driver_takes_over_and_the_preview_comes_back(self):
        with demo("oculus") as daemon, Viewer(HTTP) as viewer:
            viewer.greeted().subscribe("/front/ping", "/status")
            viewer.subscribe("/front/image")
            viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/ping" and viewer.decode(*value[::2]).get("preview"))
            with subprocess.Popen([SONARCTL, "listen", SONAR, "--wait", "100", "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as driver:
                numbers = []
                while len(numbers) < 5:
                    event = viewer.decode(*viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/ping")[::2])
                    if not event.get("preview"):
                        numbers.append(event["number"])
                    else:
                        self.assertEqual(numbers, [], "no preview while a driver is connected")
                self.assertEqual(numbers[0], 1, "previews do not change the first driver's numbers")
                driver.terminate()
            viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/ping" and viewer.decode(*value[::2]).get("preview"))
            viewer.socket.close()
            eventually(lambda: "preview ends" in daemon.log().rpartition("preview begins")[2])

    def test_the_first_ping_is_computed_while_the_page_loads(self):
        with demo("oculus") as daemon:
            request = urllib.request.Request(f"http://{HTTP}:8088/", headers={"Accept": "text/html", "Accept-Encoding": "gzip"})
            with urllib.request.urlopen(request, timeout=60) as page:
                self.assertEqual(page.status, 200)
            eventually(lambda: "preview begins" in daemon.log())
            eventually(lambda: "preview ends" in daemon.log())
            self.assertNotIn("viewer connected", daemon.log())

    def test_a_host_that_has_left_is_not_an_error(self):
        payload = struct.pack("<BBHHHHHBB", 1, 1, 0, 100, 88, 740, 1200, 1, 0)  # a scan line
        request = b"BR" + struct.pack("<HHBB", len(payload), 2601, 0, 0) + payload
        request += struct.pack("<H", sum(request) & 0xFFFF)

        def has_left():
            """Requests a line and closes its socket before the answer, so that the sonar notices that the host has left."""
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as host:
                host.bind((HTTP, 20000))
                host.sendto(request, (SONAR, 12345))
            time.sleep(0.5)
            return re.search("clients 0 now, [1-9]", run(SONARCTL, "status").stdout)

        with demo("ping360"):
            eventually(has_left)
            said = run(SONARCTL, "doctor", "--within", 60).stdout
            self.assertIn("ok    udp 127.0.0.2:12345", said)
            self.assertNotIn("The connection of", said)

    def test_a_port_that_two_products_share_names_the_one_that_answers(self):
        with demo("s500"):
            self.assertIn("connected to 127.0.0.2:51200, an S500\n", run(SONARCTL, "listen", "--wait", 100, "--pings", 2, "--quiet").stdout)

    def test_faults_are_armed(self):
        with demo("oculus"):
            self.assertEqual(run(SONARCTL, "fault", "list").stdout, "no faults\n")


class EachDemo(PageChecks, unittest.TestCase):
    def test_shows_echoes_at_once_and_its_picture_on_the_page(self):
        browser = None if WHY_NOT else self.enterContext(Browser())
        for maker, (kind, pings, _) in DEMOS.items():
            with self.subTest(demo=maker), demo(maker) as daemon:
                self.echoes_at_once(daemon, maker, kind, pings)
                if not browser:
                    continue
                product = product_of(daemon)
                for width, height, theme in ((1600, 1000, "light"), (390, 844, "dark")):
                    with self.subTest(width=width):
                        page = self.opened(browser.open(f"http://{HTTP}:8088/", width, height, touch=width < 800, theme=theme))
                        self.page_of(page, maker, product, width)
                        page.close()
        if WHY_NOT:
            self.skipTest(f"without the page: {WHY_NOT}")

    def echoes_at_once(self, daemon, maker, kind, pings):
        with Viewer(HTTP) as viewer:
            viewer.greeted().subscribe("/front/image", "/front/picture")
            self.assertEqual(viewer.first_of("/front/picture")["kind"], kind)
            seen = rows_seen(viewer, pings)
            if kind == "range image":
                share = echoes(seen, [[0] for _ in seen])  # pixels without an echo are 0
            else:
                transmit("off")
                share = echoes(seen, rows_seen(viewer, pings))
                transmit("on")
        print(f"\n  {maker}: echoes in {100 * share:.0f} % of the picture", end="", file=sys.stderr)
        self.assertGreater(share, LEAST_ECHOES, daemon.log())

    def page_of(self, page, maker, product, width):
        begin = time.monotonic()
        shown(page)
        print(f"\n  {maker}, {width} wide: picture after {time.monotonic() - begin:.1f} s", end="", file=sys.stderr)
        page.wait(f"document.querySelector('#fan-glass').dataset.kind === '{DEMOS[maker][0]}'")
        page.wait(UNCOVERED)
        page.wait(f"document.querySelector('#sonar').selectedOptions[0]?.textContent === 'front · {product}'")
        self.assertLessEqual(page.run(LACKING_PX), 0)
        word = "pinging" if maker == "3d15" else "preview"  # this demo sends to a multicast group
        page.wait(f"document.querySelector('#rate-word').textContent === '{word}'")
        self.every_control_can_be_reached(page, width, by_finger=maker == "oculus")  # the tabs are the same in every demo
        page.run("document.querySelector('#tabs [data-tab=fan]').click()")
        self.picture(page, f"demo-{maker}-{width}", 8)
        self.assert_quiet(page, f"http://{HTTP}:8088/")

    def every_control_can_be_reached(self, page, width, by_finger):
        for tab in ("fan", "scene", "clients", "faults", "log") if width < 820 else ("",):
            if tab:
                (page.touch if by_finger else page.click)(f"#tabs [data-tab={tab}]")
                page.wait(f"document.body.dataset.tab === '{tab}'")
            page.run(NOTE_FOCUSED)
            for _ in range(3):  # a message of the daemon may replace controls; then the search starts again
                wanted = set(page.run(CONTROLS))
                page.press("Tab", len(wanted) + 5)
                unreached = wanted - set(page.run(REACHED))
                if not unreached:
                    break
            self.assertEqual(unreached, set(), f"the Tab key does not reach these; tab {tab}")


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Pages(PageChecks, unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.browser = cls.enterClassContext(Browser())

    def test_the_page_shows_only_settings_that_the_sonar_has(self):
        all_of = {"oculus": (["mode", "beams", "transmit"], {"low frequency", "high frequency"}), "ping360": (["transmit"], set()),
                  "dvl": (["transmit"], set()),
                  "aris": (["mode", "transmit"], {"64 LF", "64 HF", "128 LF", "128 HF"}),
                  "3d15": (["mode", "transmit"], {"low-frequency", "high-frequency"})}
        for maker, (choices, modes) in all_of.items():
            with self.subTest(demo=maker), demo(maker):
                page = self.opened(self.browser.open(f"http://{HTTP}:8088/", 1600, 1000))
                shown(page)
                page.wait("!!document.querySelector('#setting-rows select')")
                self.assertEqual(page.run("[...document.querySelectorAll('#setting-rows select')].map((s) => s.name.split('/').pop())"), choices)
                self.assertEqual(set(page.run("[...document.querySelectorAll('#setting-rows [name$=mode] option')].map((o) => o.text)")), modes)
                self.assertEqual(page.run("!!document.querySelector('[name$=rate_hz]')"), maker not in ("ping360", "dvl"))
                if maker == "ping360":  # its host requests each ping, so the engine limits the rate
                    with subprocess.Popen([SONARCTL, "listen", "--wait", "100", "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as driver:
                        page.wait("document.querySelector('#rate-word').textContent === 'pinging'")
                        page.wait("parseFloat(document.querySelector('#rate').textContent) > 0")
                        self.assertNotIn("of 1000 Hz", page.text("#badges"))
                        driver.terminate()

    def test_wide_samples_are_as_bright_as_sonard_draws_them(self):
        """Tests makes that have shades of their own, with and without the graphics processor."""
        for maker, script in (("m3", ""), ("blueview", ""), ("m3", WITHOUT_WEBGL)):
            with self.subTest(demo=maker, webgl=not script), demo(maker), Viewer(HTTP) as viewer:
                viewer.greeted().subscribe("/front/fan")
                page = self.opened(self.browser.open(f"http://{HTTP}:8088/?test=720", 1100, 700, script=script))
                shown(page)
                page.wait("sonardTest.facts.pictures.has('front') && sonardTest.fan.per_mille === sonardTest.fan.shades.per_mille")
                page.run("sonardTest.fan.useMap('gray')")
                fans = {}

                def of_one_ping():
                    """Waits until the page has a ping whose picture the viewer has received too."""
                    page.run("sonardTest.fan.frozen = false")
                    _, ns, data = viewer.wait_for(lambda kind, value: kind == "message" and value[0] == "/front/fan")
                    fans[float(ns)] = data
                    return fans.get(page.run("(sonardTest.fan.frozen = true, sonardTest.fan.ping.ns)"))

                image = viewer.decode("/front/fan", eventually(of_one_ping))
                drawn = self.drawn(page, "gray")
                # 0 is outside of the fan; the page has a colour there.
                theirs = b"".join(bytes((v, v, v)) if v else drawn[2][3 * i:3 * i + 3] for i, v in enumerate(image["data"]))
                limits = {"most_mean": 4, "most_p99": 45, "most_above": 0.2} if script else {"most_mean": 1, "most_p99": 4, "most_above": 0.01}
                self.compare(drawn, (image["width"], image["height"], theirs), **limits)

    def test_a_preview_has_a_rate_and_not_the_latency_of_the_last_driver(self):
        with demo("oculus"):
            page = self.opened(self.browser.open(f"http://{HTTP}:8088/?test=300", 1600, 1000))
            with subprocess.Popen([SONARCTL, "listen", "--wait", "100", "--quiet"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as driver:
                page.wait("/^\\d+ ms$/.test(document.querySelector('#latency').textContent)")
                driver.terminate()
            page.wait("document.querySelector('#rate-word').textContent === 'preview'")
            page.wait("document.querySelector('#latency').textContent === '–'")
            page.wait("sonardTest.facts.preview")
            page.run("window.begun = sonardTest.facts.history.at(-1).time_s")  # earlier rates include pings of the driver
            page.wait("sonardTest.facts.history.some((h) => h.time_s > window.begun + 2 && h.rate > 0)")
            page.close()

    def test_a_waterfall_has_ranges_and_times(self):
        with demo("omniscan"):
            page = self.opened(self.browser.open(f"http://{HTTP}:8088/", 1600, 1000, script=NOTE_WORDS))
            shown(page)
            for unit in ("m", "s"):
                page.wait(f"[...window.words.keys()].some((text) => /^[\\d.]+ {unit}$/.test(text))")
            page.close()

    def test_a_picture_without_detections_says_so(self):
        """The vehicle moves; most of the time nothing is within 3 m of this demo's sonar."""
        with demo("3d15"):
            page = self.opened(self.browser.open(f"http://{HTTP}:8088/", 1600, 1000))
            shown(page)
            page.wait("!document.querySelector('#badges').innerText.includes('nothing detected')")
            page.run("document.querySelector('[name=\"/front/range_m\"]').focus(), document.activeElement.select()")
            for key in ("3", "Enter"):
                page.press(key)
            page.wait("document.querySelector('#badges').innerText.includes('nothing detected within 3 m')")
            page.close()
            with tempfile.TemporaryDirectory() as folder:
                eventually(lambda: "nothing detected within 3 m" in run(SONARCTL, "view", "--png", f"{folder}/3d15.png", "--as-it-is").stdout)

    def test_range_labels_lie_beside_a_picture_that_opens_downwards(self):
        for maker in ("norbit", "surveyor"):
            with self.subTest(demo=maker), demo(maker):
                page = self.opened(self.browser.open(f"http://{HTTP}:8088/", 1600, 1000, script=NOTE_WORDS + ";" + WITHOUT_WEBGL))
                shown(page)
                page.wait(LABELS_INSIDE + " === 'none'")  # the first words may be of a smaller picture
                page.close()

    def test_a_setting_typed_with_keys_shows_its_refusal(self):
        for width, height in ((1600, 1000), (390, 844)):
            with self.subTest(width=width), demo("oculus"):
                page = self.opened(self.browser.open(f"http://{HTTP}:8088/", width, height, touch=width < 800))
                shown(page)
                if width < 800:
                    page.touch("#tabs [data-tab=clients]")
                field = "document.querySelector('[name=\"/front/range_m\"]')"
                page.wait("!!" + field)
                page.run(field + ".focus(), document.activeElement.select()")
                for key in ("4", "Enter"):
                    page.press(key)
                page.wait(field + ".value === '4'")
                eventually(lambda: "4 m" in run(SONARCTL, "status").stdout)
                page.run(field + ".focus(), document.activeElement.select()")
                for key in ("9", "9", "9", "Enter"):
                    page.press(key)
                page.wait("document.querySelector('#refusal').offsetWidth")
                gap = page.run(f"((a, b) => Math.max(a.top - b.bottom, b.top - a.bottom))(document.querySelector('#refusal').getBoundingClientRect(), {field}.getBoundingClientRect())")
                self.assertLess(abs(gap), 20)
                self.assertLessEqual(page.run("document.querySelector('#refusal').getBoundingClientRect().right"), width)
                page.run(field + ".focus(), document.activeElement.select()")
                for key in ("6", "Enter"):
                    page.press(key)
                self.assertFalse(page.run("document.querySelector('#refusal').offsetWidth"), "the next request removes it")
                page.run(field + ".focus(), document.activeElement.select()")
                for key in ("9", "9", "9", "Enter"):
                    page.press(key)
                page.wait("document.querySelector('#refusal').offsetWidth")
                page.press("Escape")
                page.wait("!document.querySelector('#refusal').offsetWidth")


if __name__ == "__main__":
    unittest.main()
