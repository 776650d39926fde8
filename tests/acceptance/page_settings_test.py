"""Tests the settings of the sonar on the page of the live view, in a real browser with a scripted daemon (view/mock_daemon.py).
They are skipped without browser or page.
"""
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent / "view"))

from mocked_page import MockedPage  # noqa: E402
from page_checks import WHY_NOT  # noqa: E402

# Settings whose field is covered by another element.
COVERED_SETTINGS = """[...document.querySelectorAll('#setting-rows :is(input, select)')].filter((e) => {
  e.scrollIntoView({ block: 'nearest' });
  const r = e.getBoundingClientRect();
  return document.elementFromPoint(r.left + r.width / 2, r.top + r.height / 2) !== e;
}).map((e) => e.name)"""


@unittest.skipIf(WHY_NOT, WHY_NOT)
class Settings(MockedPage, unittest.TestCase):
    def test_settings_are_requested_and_refusals_shown(self):
        page = self.open()
        page.wait("document.querySelector('[name=\"/front/range_m\"]')?.value === '10'")
        change = "(v) => {{ const f = document.querySelector('[name=\"/front/range_m\"]'); f.value = v; f.dispatchEvent(new Event('change')); }}"
        page.run(f"({change.replace('{{', '{').replace('}}', '}')})('7.5')")
        self.patiently(lambda: self.mock.parameters["/front/range_m"] == 7.5)
        page.wait("document.querySelector('[name=\"/front/range_m\"]').value === '7.5'")
        page.run(f"({change.replace('{{', '{').replace('}}', '}')})('400')")
        page.wait("document.querySelector('#refusal').innerText.includes('range_m must be')")
        page.wait("document.querySelector('[name=\"/front/range_m\"]').value === '7.5'")
        self.mock.parameters["/front/range_m"] = 10.0

    def test_settings_accept_keys(self):
        page = self.open()
        field = "document.querySelector('[name=\"/front/%s\"]')"
        page.wait(field % "range_m" + "?.value === '10'")
        page.run((field % "range_m") + ".focus(), document.activeElement.select()")
        for key in ("9", "9", "Backspace", "Backspace", "7", ".", "5"):
            page.press(key)
        self.assertEqual(page.run((field % "range_m") + ".value"), "7.5")
        page.press("Enter")
        self.patiently(lambda: self.mock.parameters["/front/range_m"] == 7.5)
        page.press("ArrowUp")
        page.press("Tab")
        self.assertEqual(page.run("document.activeElement.name"), "/front/rate_hz")
        self.patiently(lambda: self.mock.parameters["/front/range_m"] == 8.5)
        self.mock.set_calls.clear()
        page.run("document.activeElement.select()")
        before = page.run("document.activeElement.value")
        page.press("3")
        page.press("Escape")
        self.assertEqual(page.run((field % "rate_hz") + ".value"), before, "Escape restores the value")
        self.assertEqual(page.run("document.activeElement === document.body"), True)
        page.press("f")
        self.assertEqual(page.text("#freeze"), "Go on", "the page's own keys work again")
        self.assertEqual(self.mock.set_calls, [])
        self.mock.parameters["/front/range_m"] = 10.0

    def test_settings_can_be_reached_with_few_keys(self):
        """The panels can be reached by a key, and by a link for users of Tab; on phones they are in another tab."""
        for width, way in ((1440, ("r",)), (1440, ("Tab", "Tab", "Enter")), (390, ("r",))):
            with self.subTest(width=width, way=way):
                page = self.open(width, 844)
                page.wait("document.querySelector('[name=\"/front/range_m\"]')?.value === '10'")
                for key in way:
                    page.press(key)
                self.assertEqual(page.run("document.activeElement.name"), "/front/range_m")
                self.assertTrue(page.run("document.activeElement.offsetWidth > 0 && document.activeElement.getBoundingClientRect().bottom <= innerHeight"))
                page.press("Escape")
                page.press("?")
                self.assertIn("to the settings", page.text("#help-keys"))
                page.close()

    def test_settings_come_first(self):
        """The settings are the first panel beside the picture, or of their tab on a phone: visible without scrolling, and the
        first that Tab reaches."""
        for width in (1600, 390):
            with self.subTest(width=width):
                page = self.open(width, 844, touch=width < 800)
                page.wait("document.querySelector('[name=\"/front/range_m\"]')?.value === '10'")
                page.wait("!!document.querySelector('#troubles button')")
                if width < 800:
                    page.click("#tabs [data-tab=clients]")  # the click moves the focus
                tops = page.run("[...document.querySelectorAll('#rail > .panel')].filter((p) => p.offsetHeight > 0).map((p) => [p.getBoundingClientRect().top, p.id]).sort((a, b) => a[0] - b[0])")
                self.assertEqual(tops[0][1], "settings", tops)
                self.assertEqual(page.run("document.querySelector('#rail').scrollTop"), 0)
                self.assertTrue(page.run("document.querySelector('#settings').getBoundingClientRect().bottom <= document.querySelector('#rail').getBoundingClientRect().bottom"))
                for key in ("Tab", "Enter", "Tab"):  # the link to the panels
                    page.press(key)
                self.assertEqual(page.run("document.activeElement.name"), "/front/range_m")
                self.picture(page, f"settings-{width}")
                page.close()

    def test_a_refusal_covers_no_other_setting(self):
        for width in (1600, 390):
            with self.subTest(width=width):
                page = self.open(width, 844)
                page.wait("document.querySelector('[name=\"/front/range_m\"]')?.value === '10'")
                page.press("r")
                for key in "400":
                    page.press(key)
                page.press("Enter")
                page.wait("document.querySelector('#refusal').innerText.includes('range_m must be')")
                self.assertEqual(page.run("document.querySelector('#refusal').previousSibling.innerText.trim().split(/\\s/)[0]"), "range")
                self.assertEqual(page.run(COVERED_SETTINGS), [])
                self.picture(page, f"refusal-{width}")
                page.close()

    def test_a_rate_on_request_is_measured(self):
        self.mock.state("on request")
        page = self.open()
        page.wait("/^9|^10/.test(document.querySelector('#measured')?.innerText)")
        page.wait("/^(9|10)\\.\\d Hz$/.test(document.querySelector('#rate').innerText)")
        self.assertIn("rate, at most", page.text("#setting-rows"))
        self.assertNotIn("1000 Hz", page.run("document.body.innerText"))
        self.assertFalse(page.run("document.querySelector('#frequency-chip').offsetWidth"), "the frequency is not known")
        self.mock.state("standby")
        page.wait("document.querySelector('#frequency-chip').offsetWidth")
        page.wait("document.querySelector('[name=\"/front/rate_hz\"]').placeholder === 'standby' && !document.querySelector('[name=\"/front/rate_hz\"]').value")


if __name__ == "__main__":
    unittest.main()
