"""Tests the page of the live view in a real browser, with a scripted daemon (view/mock_daemon.py). It is skipped without browser
or page.

Pictures of the states are kept in the folder that SONARD_SHOTS names; without it, only pictures of failed tests are kept, beside
the build.
"""
import gzip
import http.client
import json
import pathlib
import re
import sys
import tempfile
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "view"))

from mocked_page import MockedPage  # noqa: E402
from page_checks import FAINT_WORDS, LACKING_PX, LAID_OUT, NAMELESS_CONTROLS, PAGE, SMALL_TARGETS, WHY_NOT, WITHOUT_WEBGL, shown  # noqa: E402
from running_sonard import ROOT, Sonard  # noqa: E402

BUDGET_BYTES = 190_000
STATES = {  # the mock's state -> the page's name of the state, the text that the user reads, the button
    "no client": ("no-client", "No driver is connected. Nothing is simulated without one. Point a driver at 127.0.0.2.", "Preview"),
    "standby": ("standby", "Standby: 192.0.2.7 set the rate to 0.", "Ask for 10 Hz"),
    "stepped": ("stepped-waits", "Time stands still at 41.600 s: it moves when 127.0.0.1:40122 has taken ping 12 896", ""),
    "lockstep": ("lockstep-waits", "Time stands still at 41.600 s", "Step 0.1 s"),
    "follow": ("no-pose-yet", "Waiting for the first pose: time follows the poses.", ""),
    "transmit off": ("fine", "transmit is off: noise only", ""),
    "no pose": ("fine", "rov stays where it was", ""),
    "slow engine": ("fine", " of 10 Hz: computing takes 138 ms", ""),
    "fault": ("fine", "Thin tether", ""),
    "look only": ("fine", "read-only", ""),
}


# Connections as DAEMON:LINES (a line is one letter, all have the same time) -> the expected log. A daemon repeats its last 100
# lines in each connection.
LOGS_OF_CONNECTIONS = (
    ("1:abab", "abab"),
    ("1:abc 1:abcd", "abcd"),
    ("1:aab 1:aabb", "aabb"),
    ("1:aaa 1:aaaa", "aaaa"),
    ("1:abcab 1:abcabcab", "abcabcab"),
    ("1:abca 1:abcad", "abcad"),
    ("1:abc 1:ab 1:abcd", "abcd"),  # lost before all lines were repeated
    ("1:abc 1: 1:abcc 1:abccd", "abccd"),
    ("1:abc 1:dea", "abcdea"),  # more lines were lost than the daemon keeps
    ("1:abcx 1:bcde", "abcxbcde"),
    ("1:abc 2:abcd", "abcabcd"),  # another daemon
    ("1:" + "a" * 150 + " 1:" + "a" * 100 + "ab", "a" * 151 + "b"),
)
LOG_AFTER = """(connections) => {
  const facts = new sonardTest.facts.constructor();
  for (const connection of connections.split(' ')) {
    const [daemon, lines] = connection.split(':');
    facts.opened({ sessionId: `${daemon}-1` });
    facts.opened({ sessionId: `${daemon}-2` });  // a new session in the same connection
    for (const message of lines) facts.message('/log', { level: 2, message, name: 'sonard' }, 0);
    facts.connection = 'lost';
  }
  return facts.log.map((line) => line.message).join('');
}"""

# The page gets the software renderer under the name of a graphics processor.
NAMED_GRAPHICS = """window.Worker = class {
  constructor() { setTimeout(() => this.onmessage({ data: 'ANGLE (a graphics processor)' })); }
  terminate() {}
}"""
# The brightest of the picture's pixels.
BRIGHTEST = """(() => {
  const copy = Object.assign(document.createElement('canvas'), { width: 300, height: 300 }).getContext('2d');
  copy.drawImage(document.querySelector('#fan'), 0, 0, 300, 300);
  return Math.max(...copy.getImageData(0, 0, 300, 300).data.filter((_, i) => i % 4 === 0));
})()"""

# Lists drawing calls outside animation frames, and the canvases that are drawn inside them.
DRAWN_OUTSIDE = """window.outside = [], window.inside = new Set();
{
  let framed = 0;
  const ask = window.requestAnimationFrame;
  window.requestAnimationFrame = (call) => ask.call(window, (at) => {
    framed++;
    try { call(at); } finally { framed--; }
  });
  for (const name of ['putImageData', 'clearRect', 'fillRect', 'stroke', 'fill', 'drawImage']) {
    const draw = CanvasRenderingContext2D.prototype[name];
    CanvasRenderingContext2D.prototype[name] = function (...rest) {
      if (framed) window.inside.add(this.canvas.id);
      else if (this.canvas.id) window.outside.push(`${this.canvas.id}: ${name}`);
      return draw.apply(this, rest);
    };
  }
}"""


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Page(MockedPage, unittest.TestCase):
    def test_fan_equals_that_of_sonarctl_view(self):
        """The page draws a ping as `sonarctl view` does: the usual picture, and smaller ones."""
        maps = [line for line in (ROOT / "core/image/colour_map.cpp").read_text().split('"') if line.isalpha() and line.islower()]
        self.assertIn("cividis", maps)
        for name, width, colours in [("60 degrees, 8 bit", 1000, ["copper"]), ("60 degrees, 8 bit", 300, maps),
                                     ("60 degrees, 16 bit", 300, ["copper"]), ("130 degrees, 8 bit", 300, ["gray"])]:
            self.mock.pings = [self.pings[name]]
            page = self.open(1100, 700, query=f"?test={width}")
            shown(page)
            for map_name in colours:
                with self.subTest(ping=name, width=width, colours=map_name):
                    self.compare(self.drawn(page, map_name), self.reference(self.raw[name], map_name, width))
            page.close()

    def test_fan_without_a_graphics_processor_is_nearly_equal(self):
        """Without a graphics processor the page draws whole samples, so the edges of echoes may differ by one sample."""
        for name in self.pings:
            self.mock.pings = [self.pings[name]]
            page = self.open(1100, 700, query="?test=600", script=WITHOUT_WEBGL)
            shown(page)
            with self.subTest(ping=name):
                self.compare(self.drawn(page, "copper"), self.reference(self.raw[name], "copper", 600), most_mean=4, most_p99=45, most_above=0.2)
            page.close()

    def test_the_page_loads_only_its_own_files_without_errors(self):
        page = self.open()
        shown(page)
        for key in "c+fgst120?":
            page.press(key)
        page.press("Escape")
        time.sleep(1)
        self.assert_quiet(page, self.url)
        loaded = {r for r in page.requests if r.startswith(self.url)}
        self.assertLessEqual(len(loaded), 6, loaded)  # the page, its style, its icon, and three scripts

    def test_files_fit_their_budget(self):
        sizes = [int(line.split()[0]) for line in (PAGE / "sizes.txt").read_text().splitlines()]
        self.assertLessEqual(sum(sizes), BUDGET_BYTES)

    def test_all_states_are_shown(self):
        page = self.open(1100, 760)
        shown(page)
        for state, (kind, text, button) in STATES.items():
            with self.subTest(state=state):
                self.mock.state(state)
                page.wait(f"document.body.dataset.situation === '{kind}' && document.body.innerText.includes({text!r})")
                if button:
                    self.assertEqual(page.text("#notice-button"), button)
                self.picture(page, state.replace(" ", "-"), 1.5)

    def test_states_have_their_buttons(self):
        page = self.open()
        shown(page)
        for state, call in {"standby": ("/front/rate_hz", 10), "no client": ("/front/preview", True),
                            "lockstep": ("/sonard/step", {"dt_s": 0.1})}.items():
            with self.subTest(state=state):
                self.mock.state(state)
                page.wait(f"document.body.dataset.situation === '{STATES[state][0]}'")
                page.click("#notice-button")
                self.patiently(lambda: call in self.mock.set_calls)

    def test_a_read_only_viewer_steers_nothing(self):
        self.mock.state("look only")
        page = self.open()
        page.wait("document.querySelector('#troubles button')?.disabled")
        self.mock.set_calls.clear()
        page.run("document.querySelectorAll('#troubles button, #clear-faults, #play').forEach((b) => b.click())")
        page.press(" ")
        time.sleep(0.5)
        self.assertEqual(self.mock.set_calls, [])
        self.assertEqual(page.run("document.querySelector('#troubles button').title"), "this page is read-only")

    def test_faults_begin_and_are_cleared(self):
        page = self.open()
        page.wait("document.querySelector('[data-trouble=thin_tether] small')?.innerText")  # this message replaces the buttons
        page.press_mouse("[data-trouble=thin_tether]")
        page.wait("document.querySelector('.fault-card .left')?.innerText.startsWith('0:')")
        self.assertIn(("/faults/thin_tether", 20), self.mock.set_calls)
        self.assertEqual(page.text("#fault-count"), "1")
        self.assertIn("The tether is slow and delays data.", page.text(".fault-card"))
        page.click("#clear-faults")
        page.wait("!document.querySelector('.fault-card')")

    def test_buttons_of_faults_show_effects_conditions_and_obstacles(self):
        page = self.open()
        page.wait("document.querySelector('[data-trouble=lease_renewal] small')?.innerText")
        self.assertEqual(page.text("[data-trouble=lease_renewal] small"),
                         "The address is withdrawn and returns. Cannot act here: the sonar needs two network namespaces: sonarctl lab.")
        self.assertTrue(page.run("document.querySelector('[data-trouble=lease_renewal]').disabled"))
        self.assertEqual(page.run("[...document.querySelectorAll('#troubles button')].at(-1).dataset.trouble"), "lease_renewal", "faults that can act come first")
        self.assertIn("Lasts 21 s.", page.text("[data-trouble=power_cycle]"))
        self.assertIn("Does not put back the settings that it changed.", page.text("[data-trouble=second_operator]"))
        self.assertIn("Begins with a ping.", page.text("[data-trouble=bad_connector]"))
        page.press_mouse("[data-trouble=bad_connector]")
        page.wait("document.querySelector('.fault-card .left')?.innerText === 'waits for a ping'")
        page.click("#clear-faults")
        page.wait("!document.querySelector('.fault-card')")

    def test_the_reason_why_a_fault_cannot_act_is_legible(self):
        for theme in ("dark", "light"):
            with self.subTest(theme=theme):
                page = self.open(theme=theme)
                page.wait("document.querySelector('[data-trouble=lease_renewal]:disabled small')?.innerText")
                self.assertEqual([words for words in page.run(FAINT_WORDS.replace(":disabled, ", "")) if "withdrawn" in words], [])
                self.assertEqual(page.run("getComputedStyle(document.querySelector('[data-trouble=lease_renewal]')).opacity"), "1")
                page.close()

    def test_a_fault_does_not_move_the_panes_of_a_phone(self):
        page = self.open(390, 844, touch=True)
        shown(page)
        below_head = page.run("document.querySelector('main').offsetTop")
        page.touch("#tabs [data-tab=faults]")
        page.run("document.querySelector('#fault-seconds').value = '300'")
        page.touch("[data-trouble=thin_tether]")
        page.wait("document.querySelector('#tab-faults').innerText === '1'")
        self.assertEqual(page.run("document.querySelector('main').offsetTop"), below_head)
        self.assert_fits(page, 390, "fault-")
        page.touch("#tabs [data-tab=faults]")
        page.touch("#clear-faults")
        page.wait("document.querySelector('#tab-faults').hidden")

    def test_the_page_reconnects(self):
        page = self.open(1100, 760)
        shown(page)
        self.mock.state("lost")
        page.wait("document.querySelector('#notice-text').innerText.includes('sonard has not answered for')")
        self.picture(page, "lost", 1)
        self.mock.state("fine")
        page.wait("document.body.dataset.situation === 'fine'")

    def test_a_connection_for_commands_needs_no_pings_and_addresses_say_what_they_carry(self):
        self.mock.state("commands")
        page = self.open()
        shown(page)
        page.wait("document.querySelector('#clients tr .dot').className === 'dot ok'")  # the rate of the driver is known
        rows = page.run("[...document.querySelectorAll('#clients tr')].map((r) => [r.querySelector('.dot').className, r.children[1].innerText, r.children[3].innerText])")
        self.assertEqual(rows[1], ["dot ok", "–", "–"])
        self.assertIn("2 driver connections", page.text("#connection-count"))
        self.assertIn("for commands: it gets no pings", page.run("document.querySelector('#clients tr:nth-child(2) .who').title"))
        self.assertEqual(page.run("[...document.querySelectorAll('#addresses li')].map((e) => e.innerText)"),
                         ["tcp 127.0.0.2:2210 · points", "tcp 127.0.0.2:2209 · commands", "status 127.255.255.255:9 · sent without a request"])

    def test_log_lines_that_a_new_connection_brings_again_are_shown_once(self):
        page = self.open(1100, 760, query="?test=300")
        shown(page)
        page.wait("document.querySelectorAll('.log-line').length > 3")
        count = "[...document.querySelectorAll('.log-line')].filter((e) => e.innerText.includes('%s')).length"
        page.run("[0, 0, 1].forEach((ns) => sonardTest.facts.message('/log', { level: 2, message: 'a new line', name: 'sonard' }, ns))")
        page.wait(count % "a new line" + " === 3")  # the daemon's clock may stand still
        for connections, expected in LOGS_OF_CONNECTIONS:
            with self.subTest(connections):
                got = page.run(f"(({LOG_AFTER})({json.dumps(connections)}))")
                self.assertEqual(got, expected)

    def test_the_page_requires_the_token(self):
        self.mock.token = "secret"
        page = self.open(1100, 760)
        page.wait("document.querySelector('#token').offsetWidth > 0")
        self.picture(page, "token")
        page.run("document.querySelector('#token').value = 'secret', document.querySelector('#token-form').requestSubmit()")
        shown(page)

    def test_the_page_works_without_webgl(self):
        page = self.open(1100, 760, script=WITHOUT_WEBGL)
        shown(page)
        self.assertTrue(page.run("document.querySelector('#fan').offsetWidth"))
        page.wait("document.querySelector('#badges').innerText.includes('no scene')")
        self.assertGreater(page.run("document.querySelector('#fan-pane').offsetWidth"), 700, "the picture also uses the space of the scene")
        self.picture(page, "no-webgl")
        page.press("0")
        page.wait("document.querySelector('#no-scene').offsetWidth > 0")
        self.assertTrue(page.run("[...document.querySelectorAll('.camera')].every((button) => button.disabled)"))
        page.run("1")
        self.assertEqual(page.errors, [])

    def test_a_graphics_processor_draws_the_fan(self):
        page = self.open(1100, 760, script=NAMED_GRAPHICS)
        shown(page)
        page.wait("!!document.querySelector('#fan').getContext('webgl2')")  # null if the canvas has another context
        number = page.text("#ping-number")
        page.wait(f"document.querySelector('#ping-number').textContent !== '{number}'")
        page.wait(BRIGHTEST + " > 100")
        for key in "cfg+":
            page.press(key)
        page.size(1000, 700)
        page.wait(BRIGHTEST + " > 100")
        self.assert_quiet(page, self.url)

    def test_canvases_are_drawn_in_animation_frames_alone(self):
        """If another task draws, the browser may wait for the graphics processor, and clicks would wait too."""
        page = self.open(script=DRAWN_OUTSIDE)
        shown(page)
        for key in "tffc+g":
            page.press(key)
        for canvas in ("fan", "fan-marks", "history", "ramp"):
            page.wait(f"window.inside.has('{canvas}') || window.outside.length > 0")
        number = page.text("#ping-number")
        page.wait(f"document.querySelector('#ping-number').textContent !== '{number}'")
        self.assertEqual(page.run("[...new Set(window.outside)]"), [])

    def test_the_browser_draws_changes_in_each_corner(self):
        """The browser draws no frame if only pixels outside its window change, so a click there would seem slow."""
        page = self.opened(self.browser.open("about:blank", 1600, 1000))
        events = []
        page.note = lambda word: events.append(word)
        page.run("document.body.innerHTML = '<p id=corner style=\"position:fixed;right:0;bottom:0;margin:0\">0</p>', 0")
        page.run(LAID_OUT)
        page.call("Tracing.start", transferMode="ReportEvents", traceConfig={"includedCategories": ["viz"]})
        for number in range(1, 31):
            page.run(f"corner.textContent = {number}, {LAID_OUT}")
        page.call("Tracing.end")
        self.patiently(lambda: page.run("0") == 0 and any(word.get("method") == "Tracing.tracingComplete" for word in events))
        names = [event["name"] for word in events if word.get("method") == "Tracing.dataCollected" for event in word["params"]["value"]]
        self.assertGreater(names.count("Display::DrawAndSwap"), 0)
        self.assertLess(names.count("Draw skipped."), 5)

    def test_a_list_that_changes_keeps_the_focus(self):
        page = self.open(query="?test=500")
        shown(page)
        page.run("""window.files = ['a'],
          sonardTest.facts.setStatus = ((old) => function (status, ns) {
            old.call(this, { ...status, recordings: files.map((file) => ({ file: `/tmp/${file}.mcap`, sonar: 'front', pings: 5, bytes: 1e6, why: 'ended' })) }, ns);
          })(sonardTest.facts.setStatus), 0""")
        page.wait("document.querySelectorAll('#recordings a').length === 1")
        page.run("document.querySelector('#recordings a').focus(), window.files.push('b')")
        page.wait("document.querySelectorAll('#recordings a').length === 2")
        self.assertIn("a.mcap", page.run("document.activeElement.href ?? ''"))

    def test_keys(self):
        page = self.open()
        shown(page)
        before = page.run("document.querySelector('#map').value")
        page.press("c")
        self.assertNotEqual(page.run("document.querySelector('#map').value"), before)
        page.press("+")
        self.assertEqual(page.text("#gain-text"), "×1.2")
        page.press("f")
        self.assertEqual(page.text("#freeze"), "Go on")
        page.press("2")
        self.assertEqual(page.run("document.querySelector('#fan-pane').offsetWidth"), 0)
        page.press("0")
        self.assertGreater(page.run("document.querySelector('#fan-pane').offsetWidth"), 100)
        self.mock.set_calls.clear()
        page.press(" ")
        self.patiently(lambda: self.mock.set_calls)
        time.sleep(0.5)
        self.assertEqual(self.mock.set_calls, [("/rov/trajectory/paused", True)], "the space key acts once")
        page.run("document.querySelector('#setting-rows input').focus()")
        page.press("c")
        page.press("?")
        self.assertFalse(page.run("document.querySelector('#help').open"))
        page.run("document.activeElement.blur()")
        page.press("?")
        self.assertTrue(page.run("document.querySelector('#help').open"))

    def test_the_page_does_not_scroll_sideways(self):
        for width, height in ((320, 640), (390, 844), (768, 1024), (1440, 900), (2560, 1440)):
            with self.subTest(width=width):
                page = self.open(width, height, touch=width < 800)
                shown(page)
                page.run("document.querySelector('#sonar').options[0].text = 'forward-looking · Surveyor 240-16'")
                self.assertLessEqual(page.run(LACKING_PX), 0)
                self.assert_fits(page, width)
                page.close()

    def test_texts_have_contrast_and_controls_have_names(self):
        """Checks the contrast of words, the names of controls and the size of targets on touch screens, in dark and light."""
        for theme in ("dark", "light"):
            for touch in (False, True):
                with self.subTest(theme=theme, touch=touch):
                    page = self.open(390 if touch else 1440, 844 if touch else 900, touch=touch, theme=theme)
                    shown(page)
                    page.run("localStorage.clear(), document.documentElement.dataset.theme = '%s', document.body.dataset.tab = 'faults'" % theme)
                    self.assertEqual(page.run(FAINT_WORDS), [])
                    self.assertEqual(page.run(NAMELESS_CONTROLS), [])
                    if touch:
                        self.assertEqual(page.run(SMALL_TARGETS), [])
                    self.picture(page, f"{theme}{'-phone' if touch else ''}")
                    page.close()

    def test_numbers_are_true(self):
        page = self.open()
        page.wait("Math.abs(document.querySelector('#clients tr:nth-child(2) td:nth-child(2)').innerText - 7) <= 0.3")
        first, deadline = self.mock.drops, time.monotonic() + 100
        while time.monotonic() < deadline:  # drops increase every four seconds, and the page shows them a little later
            made = self.mock.drops
            rows = page.run("[...document.querySelectorAll('#clients tr')].map((r) => [...r.children].map((c) => c.innerText.trim()))")
            slow = next(r for r in rows if r[0].startswith("192.0.2.9"))
            if first < int(slow[3].split()[0]) <= made and abs(float(slow[2]) - 7 * 231_000 * 8 / 1e6) < 0.6:
                return
            time.sleep(0.1)
        self.fail(f"{slow} with {made} drops")


@unittest.skipIf(WHY_NOT == "this build has no page", WHY_NOT)
class Serving(unittest.TestCase):
    """Checks the page that sonard itself sends; page_test.cpp tests the answers without sockets."""

    @staticmethod
    def ask(daemon, path, method="GET", **headers):
        connection = http.client.HTTPConnection(daemon.address, 8088, timeout=20)
        connection.request(method, path, headers={name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        body = answer.read()
        connection.close()
        return answer, body

    def test_browsers_get_the_page_and_others_the_help_text(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        token = pathlib.Path(folder.name) / "token"
        token.write_text("0123456789abcdef0123456789abcdef")
        token.chmod(0o600)
        with Sonard(control=f", token_file: {token}") as daemon:
            self.assertEqual(daemon.log().splitlines()[1], f"open      http://{daemon.address}:8088   the live view, in a browser")
            browser = {"Accept": "text/html,*/*;q=0.8", "Accept_Encoding": "gzip, br"}
            answer, body = self.ask(daemon, "/", **browser)
            self.assertEqual(answer.status, 200)
            self.assertEqual(gzip.decompress(body), (PAGE / "index.html").read_bytes())
            self.assertIn("default-src 'none'", answer.headers["Content-Security-Policy"])
            self.assertEqual(answer.headers.get_all("Cache-Control"), ["no-cache"])
            self.assertEqual(answer.headers["X-Content-Type-Options"], "nosniff")
            tag = answer.headers["ETag"]
            answer, body = self.ask(daemon, "/", "HEAD", **browser)
            self.assertEqual((answer.status, body), (200, b""))
            self.assertEqual(self.ask(daemon, "/", If_None_Match=tag, **browser)[0].status, 304)
            for name in re.findall(r'"(/[a-z]+-[0-9a-f]{10}[^"]+)"', (PAGE / "index.html").read_text()):
                answer, body = self.ask(daemon, name, Accept_Encoding="gzip")
                self.assertEqual(answer.status, 200)
                self.assertIn("immutable", answer.headers["Cache-Control"])
                self.assertEqual(gzip.decompress(body), (PAGE / name[1:]).read_bytes())
            self.assertEqual(self.ask(daemon, "/", Host="elsewhere.example", **browser)[0].status, 403)
            self.assertEqual(self.ask(daemon, "/")[0].status, 401)
            answer, body = self.ask(daemon, "/", Authorization=f"Bearer {token.read_text()}")
            self.assertIn(b"curl -s", body)
            self.assertEqual(answer.headers["Vary"], "Accept")


if __name__ == "__main__":
    unittest.main()
