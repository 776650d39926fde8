"""Drives Debian's chromium over its debugging protocol: pages, scripts, pictures. Standard library only."""
import base64
import json
import os
import pathlib
import shutil
import socket
import subprocess
import tempfile
import time
import urllib.parse
import urllib.request

from websocket import TEXT, WebSocket

KEY_NUMBERS = {"Backspace": 8, "Home": 36, "ArrowLeft": 37, "ArrowRight": 39, "Tab": 9, "Enter": 13, "Escape": 27, "ArrowUp": 38, "ArrowDown": 40}

WINDOW = "1640,1100"  # larger than all pages of the tests, because the browser draws no frame if only pixels outside change


def program():
    """Returns the path of the browser, or None."""
    return os.environ.get("SONARD_BROWSER") or shutil.which("chromium") or shutil.which("chromium-browser")


class Navigated(RuntimeError):
    """The page was replaced by another before the browser answered."""


class Browser:
    """with Browser() as browser: page = browser.open(url)"""

    def __enter__(self):
        self.folder = tempfile.TemporaryDirectory(prefix="browser-", ignore_cleanup_errors=True)
        self.process = subprocess.Popen(
            [program(), "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-sandbox",
             "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
             "--disable-dev-shm-usage", "--remote-debugging-port=0", f"--window-size={WINDOW}", f"--user-data-dir={self.folder.name}", "about:blank"],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port_file = pathlib.Path(self.folder.name) / "DevToolsActivePort"  # the browser writes its port there
        deadline = time.monotonic() + 200
        while self.process.poll() is None and time.monotonic() < deadline:
            if port_file.is_file() and "\n" in port_file.read_text():
                self.at = "127.0.0.1:" + port_file.read_text().splitlines()[0]
                return self
            time.sleep(0.05)
        self.__exit__()
        raise RuntimeError("the browser did not start")

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.folder.cleanup()

    def open(self, url, width=1440, height=900, **options):
        request = urllib.request.Request(f"http://{self.at}/json/new?about:blank", method="PUT")
        with urllib.request.urlopen(request) as answer:
            target = json.load(answer)
        page = Page(urllib.parse.urlsplit(target["webSocketDebuggerUrl"]), width, height, **options)
        page.call("Storage.clearDataForOrigin", origin=url.partition("/?")[0].rstrip("/"), storageTypes="all")
        page.go(url)
        return page


class Page:
    def __init__(self, url, width, height, scale=1, touch=False, script="", theme="dark"):
        host, _, port = url.netloc.partition(":")
        self.socket = WebSocket.connect(socket.create_connection((host, int(port)), timeout=180), url.netloc, url.path)
        self.calls, self.answers, self.requests, self.errors = 0, {}, [], []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.size(width, height, scale, touch)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": theme}])
        if script:
            self.call("Page.addScriptToEvaluateOnNewDocument", source=script)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        try:
            self.call("Page.close")
        except OSError:
            pass  # it is already closed
        self.socket.close()

    def size(self, width, height, scale=1, touch=False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=touch)
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch)

    def call(self, method, **parameters):
        return self.answer(self.ask(method, **parameters))

    def ask(self, method, **parameters):
        """Sends a call; answer() waits for the result."""
        self.calls += 1
        self.socket.send(TEXT, json.dumps({"id": self.calls, "method": method, "params": parameters}))
        return self.calls, method

    def answer(self, asked):
        number, method = asked
        while number not in self.answers:
            message = self.socket.receive()
            if message is None:
                raise ConnectionError("the browser has closed the page")
            word = json.loads(message[1])
            if "id" in word:
                self.answers[word["id"]] = word
            else:
                self.note(word)
        word = self.answers.pop(number)
        if "error" in word:
            kind = Navigated if "navigated" in word["error"]["message"] else RuntimeError
            raise kind(f"{method}: {word['error']['message']}")
        return word["result"]

    def note(self, word):
        """Collects requests, and the errors in the console."""
        method, about = word.get("method"), word.get("params", {})
        if method in ("Network.requestWillBeSent", "Network.webSocketCreated"):
            self.requests.append(about.get("url") or about["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.errors.append(details.get("exception", {}).get("description") or details["text"])
        elif method == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(f"{about['entry']['text']} {about['entry'].get('url', '')}")
        elif method == "Runtime.consoleAPICalled" and about["type"] in ("error", "assert"):
            self.errors.append(str([a.get("value", a.get("description")) for a in about["args"]]))

    def go(self, url):
        self.call("Page.navigate", url=url)

    def run(self, expression):
        """Returns the value of an expression, or the result of its promise."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(result["exceptionDetails"].get("exception", {}).get("description") or str(result["exceptionDetails"]))
        return result["result"].get("value")

    def wait(self, expression, patience_s=200):
        """Waits until the expression is true; returns its value."""
        deadline = time.monotonic() + patience_s
        while time.monotonic() < deadline:
            try:
                value = self.run(expression)
            except RuntimeError:
                value = None
            if value:
                return value
            time.sleep(0.1)
        raise AssertionError(f"not true within {patience_s} s: {expression}")

    def text(self, selector):
        return self.run(f"document.querySelector({json.dumps(selector)})?.innerText ?? ''")

    def press(self, key, times=1):
        """Sends several key presses at once, because each alone would wait for the browser, which is slow without a GPU."""
        code = {" ": "Space", "?": "Slash"}.get(key, key)
        text = {"text": key} if len(key) == 1 else {"text": "\r"} if key == "Enter" else {}
        number = {"windowsVirtualKeyCode": KEY_NUMBERS[key]} if key in KEY_NUMBERS else {}  # without this number the browser ignores the key
        asked = []
        for _ in range(times):
            asked.append(self.ask("Input.dispatchKeyEvent", type="keyDown", key=key, code=code, **text, **number))
            asked.append(self.ask("Input.dispatchKeyEvent", type="keyUp", key=key, code=code, **number))
        for each in asked:
            self.answer(each)

    def click(self, selector):
        """Clicks by script. It first waits for the element, because a message of the daemon may add or replace it."""
        self.wait(f"!!document.querySelector({json.dumps(selector)})")
        self.run(f"document.querySelector({json.dumps(selector)}).click()")

    def place(self, selector):
        """Scrolls an element into view, waits until it is enabled and stops moving (a slow page may still change its layout), and
        returns its middle."""
        element = f"document.querySelector({json.dumps(selector)})"
        self.wait(f"{element}?.offsetWidth && !{element}.disabled")
        before, place = None, []
        while place != before:
            before = place
            place = self.run(f"((e) => (e.scrollIntoView({{block: 'nearest'}}), (({{x, y, width, height}}) => [x + width / 2, y + height / 2])"
                             f"(e.getBoundingClientRect())))({element})")
            time.sleep(0.1)
        return place

    def press_mouse(self, selector):
        """Clicks as a mouse does: the topmost element at that place gets the click. A message of the daemon can move the element
        between the measurement of its position and the press, so a click that reached another element is repeated."""
        for _ in range(5):
            x, y = self.place(selector)
            self.run("window.clicked = null, addEventListener('click', (e) => { window.clicked = e.target; }, {capture: true, once: true})")
            for kind in ("mousePressed", "mouseReleased"):
                self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
            try:  # undefined if a click on a link has loaded another page
                other = self.run(f"""window.clicked === undefined || window.clicked?.closest({json.dumps(selector)}) ? ''
                  : window.clicked?.outerHTML.slice(0, 200) ?? 'nothing'""")
            except Navigated:
                return
            if not other:
                return
        raise AssertionError(f"a click at the place of {selector} reaches {other}")

    def touch(self, selector):
        """Taps as a finger does."""
        x, y = self.place(selector)
        self.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[{"x": x, "y": y}])
        self.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def picture(self, path):
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        with open(path, "wb") as file:
            file.write(data)
