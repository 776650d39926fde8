"""The checks of the browser tests of the page, with a scripted daemon (page_test.py) and a real one (page_live_test.py)."""
import base64
import contextlib
import os
import pathlib
import shutil
import sys
import time
import unittest

from browser import program
from pictures import difference, mirrored, read_png
from running_sonard import BUILD, SONARCTL, run

PAGE = BUILD / "clients/web/page"
SHOTS = pathlib.Path(os.environ["SONARD_SHOTS"]) if os.environ.get("SONARD_SHOTS") else None
FAILED_SHOTS = SHOTS or BUILD / "tests/page-pictures"
WHY_NOT = ("this build has no page" if not (PAGE / "index.html").is_file() else
           "no chromium" if program() is None else
           "no protoc" if shutil.which("protoc") is None else "")
TABS = ("fan", "scene", "clients", "faults", "log")

# Elements whose words have a contrast of less than 4.5 to 1 to their background (WCAG 1.4.3).
FAINT_WORDS = """(() => {
  const channels = (c) => c.match(/[\\d.]+/g).map(Number);
  const light = ([r, g, b]) => [r, g, b].map((v) => (v /= 255) <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (e) => {
    for (; e; e = e.parentElement) {
      const c = channels(getComputedStyle(e).backgroundColor);
      if (c.length === 3 || c[3] > 0.8) return c;
    }
    return [255, 255, 255];
  };
  return [...document.querySelectorAll('body *')].filter((e) => e.offsetWidth && !e.closest(':disabled, .unseen, .skip, option')
    && [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim())).filter((e) => {
      const [a, b] = [light(channels(getComputedStyle(e).color)), light(behind(e))];
      return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05) < 4.5;
    }).map((e) => `${e.id || e.className || e.tagName}: ${e.textContent.slice(0, 30)}`);
})()"""
NAMELESS_CONTROLS = """[...document.querySelectorAll('button, input, select, canvas:not([aria-hidden])')].filter((e) => e.offsetWidth
  && !(e.getAttribute('aria-label') || e.labels?.length || /\\w/.test(e.textContent) && e.tagName === 'BUTTON')).map((e) => e.outerHTML.slice(0, 80))"""
SMALL_TARGETS = """[...document.querySelectorAll('button:not(.link), select')].filter((e) => e.offsetWidth && (e.offsetHeight < 44 || e.offsetWidth < 44))
  .map((e) => `${e.id || e.className} ${e.offsetWidth} x ${e.offsetHeight}`)"""
CUT_WORDS = """[...document.querySelectorAll('button, .chip, h2')].filter((e) => e.offsetWidth && !e.closest('.unseen') && e.scrollWidth > e.clientWidth + 1)
  .map((e) => `${e.id || e.className}: ${e.innerText}`)"""
WIDER_THAN = """[...document.querySelectorAll('main *, header *, nav *')].filter((e) => e.offsetWidth && !e.closest('#fan-glass, .unseen')
  && e.getBoundingClientRect().right > WIDTH + 1).map((e) => e.id || e.className || e.tagName)"""

WITHOUT_WEBGL = """window.Worker = class { constructor() { setTimeout(() => this.onmessage({ data: null })); } terminate() {} };
HTMLCanvasElement.prototype.getContext = ((old) => function (kind, ...rest) {
  return kind === 'webgl2' ? null : old.call(this, kind, ...rest); })(HTMLCanvasElement.prototype.getContext)"""

# The width [px] that the list of sonars lacks to show whole names.
LACKING_PX = """((e) => {
  const whole = e.cloneNode(true);
  whole.style.cssText = 'position: absolute; max-width: none; width: max-content';
  e.after(whole);
  const lacking = whole.offsetWidth - e.offsetWidth;
  whole.remove();
  return lacking;
})(document.querySelector('#sonar'))"""


# A promise that is resolved when the present page has been laid out and drawn.
LAID_OUT = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def shown(page, patience_s=200):
    """Waits until the page has drawn a ping and lists the sonars, because the page draws pings before it has the list."""
    page.wait("/\\d/.test(document.querySelector('#ping-number').textContent) && document.querySelector('#sonar').options.length", patience_s)


class PageChecks:
    """Methods for a TestCase."""

    @staticmethod
    def picture(page, name, settled_s=0.0):
        """Stores a picture in the folder SONARD_SHOTS, after a short wait for moving parts."""
        if SHOTS:
            SHOTS.mkdir(parents=True, exist_ok=True)
            time.sleep(settled_s)
            page.picture(SHOTS / f"{name}.png")

    open_pages = ()

    def opened(self, page):
        """Returns the page, and closes it at the end of the test. If the test, or a part of it, fails, a picture is kept."""
        self.open_pages = (*self.open_pages, page)
        self.addCleanup(page.close)
        return page

    @contextlib.contextmanager
    def pictures_of_failure(self):
        try:
            yield
        except unittest.SkipTest:
            raise
        except Exception:
            FAILED_SHOTS.mkdir(parents=True, exist_ok=True)
            for number, page in enumerate(self.open_pages):
                with contextlib.suppress(OSError, RuntimeError):  # it is already closed, or another page is being loaded
                    page.picture(FAILED_SHOTS / f"failed-{self.id().rpartition('.')[2]}-{number}.png")
            raise

    def _callTestMethod(self, method):  # pylint: disable=invalid-name
        with self.pictures_of_failure():
            super()._callTestMethod(method)

    @contextlib.contextmanager
    def subTest(self, *message, **parameters):  # pylint: disable=invalid-name
        with super().subTest(*message, **parameters), self.pictures_of_failure():
            yield

    def patiently(self, condition, patience_s=200):
        deadline = time.monotonic() + patience_s
        while not condition():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.05)

    def reference(self, raw, map_name, width):
        """Returns the picture that `sonarctl view` draws of the message of a ping in a file."""
        png = pathlib.Path(f"{raw}.png")
        done = run(SONARCTL, "view", "--from-raw", raw, "--png", png, "--no-rings", "--colour-map", map_name, "--width", width)
        self.assertEqual(done.returncode, 0, done.stderr)
        return read_png(png.read_bytes())

    @staticmethod
    def drawn(page, map_name):
        url = page.run(f"sonardTest.fan.useMap('{map_name}'), sonardTest.fan.paint(), document.querySelector('#fan').toDataURL()")
        return read_png(base64.b64decode(url.partition(",")[2]))

    def compare(self, drawn, reference, most_mean=0.5, most_p99=2, most_above=0.001):
        (width, height, ours), (_, other_height, theirs) = drawn, reference
        self.assertEqual(width, reference[0])
        self.assertLessEqual(abs(height - other_height), 1)  # the page computes bearings with 32 bits, sonarctl with 64
        height = min(height, other_height)
        ours, theirs = ours[:3 * width * height], theirs[:3 * width * height]
        mean, p99, above = difference(ours, theirs)
        print(f"\n  {width} pixels wide: mean {mean:.3f}, p99 {p99}, above 8: {100 * above:.4f} %", end="", file=sys.stderr)
        self.assertLessEqual(mean, most_mean)
        self.assertLessEqual(p99, most_p99)
        self.assertLessEqual(above, most_above)
        self.assertGreater(difference(mirrored(width, height, ours), theirs)[0], max(2, 2 * mean))

    def assert_fits(self, page, width, name=""):
        """Checks that no pane scrolls sideways and no words are cut."""
        for tab in TABS if width < 820 else TABS[:1]:
            if width < 820:
                page.click(f"#tabs [data-tab={tab}]")
                page.run(LAID_OUT)
            self.assertLessEqual(page.run("document.documentElement.scrollWidth"), width)
            self.assertEqual(page.run(WIDER_THAN.replace("WIDTH", str(width))), [], tab)
            self.assertEqual(page.run(CUT_WORDS), [], tab)
            self.picture(page, f"{name}{width}-{tab}")

    def assert_quiet(self, page, url):
        """Checks that the console has no error and that all requests go to `url`."""
        page.run("1")
        self.assertEqual(page.errors, [])
        own = url.replace("http", "", 1)
        strangers = [r for r in page.requests if not r.startswith(("http" + own, "ws" + own, "blob:", "data:", "about:"))]
        self.assertEqual(strangers, [])
