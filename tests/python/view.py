"""The page of `omnibus view` in Chromium: what a person does and sees there.

Usage: view.py CHROMIUM URL PICTURE simulator|recording|data_set

Chromium is driven by its own protocol (https://chromedevtools.github.io/devtools-protocol) over a
WebSocket (RFC 6455), so that nothing else has to be installed. It prints `seen` at the end.
"""

import base64
import itertools
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import typing
import urllib.request

# Ends a test that hangs.
signal.alarm(240)


class Browser:
    """A page in a headless Chromium."""

    def __init__(self, program: str, folder: str) -> None:
        options = [
            "--headless", "--no-sandbox", "--no-first-run", "--disable-background-networking",
            "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1500,900",
            "--remote-debugging-port=0", f"--user-data-dir={folder}", "about:blank",
        ]  # fmt: skip
        log = (pathlib.Path(folder) / "log").open("w")
        self.process = subprocess.Popen([program, *options], stdout=log, stderr=log)
        ready = pathlib.Path(folder) / "DevToolsActivePort"
        while not ready.exists() or not ready.read_text().endswith("\n") and "/" not in ready.read_text():
            if self.process.poll() is not None:
                sys.exit(pathlib.Path(log.name).read_text())
            time.sleep(0.05)
        self.port = int(ready.read_text().split()[0])
        pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{self.port}/json/list"))
        path = next(page for page in pages if page["type"] == "page")["webSocketDebuggerUrl"]
        self.numbers = itertools.count(1)
        self.events: list[dict[str, typing.Any]] = []
        self.connect("/" + path.split("/", 3)[3])

    def connect(self, path: str) -> None:
        self.socket = socket.create_connection(("127.0.0.1", self.port))
        self.file = self.socket.makefile("rb")
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [
            f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{self.port}", "Upgrade: websocket",
            "Connection: Upgrade", f"Sec-WebSocket-Key: {key}", "Sec-WebSocket-Version: 13",
        ]  # fmt: skip
        self.socket.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        assert b"101" in self.file.readline()
        while self.file.readline().strip():
            pass

    def receive(self) -> dict[str, typing.Any]:
        text = b""
        while True:
            first, length = self.file.read(2)
            if length == 126:
                (length,) = struct.unpack(">H", self.file.read(2))
            elif length == 127:
                (length,) = struct.unpack(">Q", self.file.read(8))
            text += self.file.read(length)
            if first & 0x80:
                return json.loads(text)

    def call(self, method: str, **params: object) -> dict[str, typing.Any]:
        number = next(self.numbers)
        data = json.dumps({"id": number, "method": method, "params": params}).encode()
        length = struct.pack(">BBQ", 0x81, 0xFF, len(data))
        # The mask of zeros changes nothing.
        self.socket.sendall(length + bytes(4) + data)
        while True:
            message = self.receive()
            if message.get("id") == number:
                assert "error" not in message, (method, message)
                return message["result"]
            self.events.append(message)

    def value(self, script: str) -> typing.Any:
        result = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def text(self, selector: str) -> str:
        return self.value(f"document.querySelector({selector!r})?.textContent ?? ''")

    def click(self, selector: str) -> None:
        self.value(f"document.querySelector({selector!r}).click()")

    def key(self, kind: str, code: str) -> None:
        self.call("Input.dispatchKeyEvent", type=kind, code=code, key=code[-1].lower())

    def until(self, what: str, is_so: typing.Callable[[], typing.Any]) -> typing.Any:
        """Waits for as long as the test may last."""
        signal.signal(signal.SIGALRM, lambda *_: sys.exit(f"{what} did not come about: {self.page()}"))
        while not (found := is_so()):
            time.sleep(0.05)
        return found

    def page(self) -> str:
        return self.value("document.body.innerText")


def first_number(text: str) -> float:
    found = re.search(r"-?\d+(\.\d+)?", text)
    return float(found.group()) if found else 0.0


def detail(browser: Browser, name: str) -> str:
    rows = browser.value("[...document.querySelectorAll('#details tr')].map((r) => [...r.cells].map((c) => c.textContent))")
    return dict(rows).get(name, "")


# Different colours in a canvas, read after the page's next picture.
COLORS = """(() => {
  const from = document.querySelectorAll('canvas')[%d], to = document.createElement('canvas');
  [to.width, to.height] = [64, 36];
  const context = to.getContext('2d');
  context.drawImage(from, 0, 0, 64, 36);
  return new Set(new Uint32Array(context.getImageData(0, 0, 64, 36).data.buffer)).size;
})()"""


GAMEPAD = """
  window.pad = { connected: true, mapping: 'standard', axes: [0, 0, 0, 0],
    buttons: Array.from({ length: 17 }, () => ({ pressed: false, value: 0 })) };
  navigator.getGamepads = () => [null, window.pad];
"""


def frame_of(label: str) -> int:
    return int(label.rsplit("· ", 1)[1]) if "· " in label else 0


def look(browser: Browser, url: str, picture: str, source: str) -> None:
    for domain in ["Page", "Runtime", "Network", "Log"]:
        browser.call(f"{domain}.enable")
    browser.call("Page.navigate", url=url)
    browser.until("the title", lambda: " · " in browser.text("#title"))
    {"simulator": drive, "recording": play, "data_set": play}[source](browser)
    shot = browser.call("Page.captureScreenshot", format="png")
    pathlib.Path(picture).write_bytes(base64.b64decode(shot["data"]))
    check(browser.events, url)


def drive(browser: Browser) -> None:
    """Drives a car in a running simulator."""
    clock = lambda: first_number(browser.text("#clock").removeprefix("frame "))
    browser.until("frames", lambda: clock() > 0)
    label = lambda: frame_of(browser.text(".tile .bar span"))

    browser.click("#spawn-ego")
    browser.until("a vehicle", lambda: detail(browser, "blueprint") == "vehicle.tesla.model3")
    seen = browser.until("an image", label)
    browser.until("a second image", lambda: label() > seen)
    browser.until("a colourful map", lambda: browser.value(COLORS % 0) > 3)
    browser.until("a colourful image", lambda: browser.value(COLORS % 2) > 50)
    browser.until("points", lambda: frame_of(browser.text(".tile:nth-of-type(2) .bar span")))

    place = detail(browser, "position")
    browser.key("rawKeyDown", "KeyW")
    browser.until("speed", lambda: first_number(detail(browser, "speed")) > 10)
    assert detail(browser, "position") != place
    assert "throttle 1.00" in detail(browser, "pedals"), detail(browser, "pedals")
    browser.key("keyUp", "KeyW")
    browser.until("a released pedal", lambda: "throttle 0.00" in detail(browser, "pedals"))

    # A gamepad in the standard mapping: the right trigger accelerates, the left one brakes.
    browser.value(GAMEPAD)
    pad = "window.pad.buttons[%d].value = %s"
    browser.value(pad % (7, 0.6))
    browser.value("window.pad.axes[0] = -0.5")
    browser.until("the trigger", lambda: "throttle 0.60" in detail(browser, "pedals"))
    browser.until("the stick", lambda: detail(browser, "steering") == "0.250")
    browser.value(pad % (7, 0) + ";" + pad % (6, 1) + "; window.pad.axes[0] = 0")
    browser.until("a brake", lambda: "brake 1.00" in detail(browser, "pedals"))
    browser.until("a stop", lambda: first_number(detail(browser, "speed")) < 1)
    browser.value(pad % (6, 0))
    browser.until("released triggers", lambda: "brake 0.00" in detail(browser, "pedals"))

    browser.click("#pause")
    browser.until("a pause", lambda: "this page holds the tick" in browser.text("#tick"))
    stands = clock()
    browser.click("#step")
    browser.until("one frame", lambda: clock() == stands + 1)
    browser.click("#play")
    browser.until("time that passes", lambda: clock() > stands + 3)
    browser.until("a released tick", lambda: "holds the tick" not in browser.text("#tick"))


def play(browser: Browser) -> None:
    """Looks through what has a length."""
    at = lambda: first_number(browser.text("#tick"))
    is_shown = lambda selector: browser.value(f"document.querySelector({selector!r}).offsetParent !== null")
    browser.until("a slider", lambda: is_shown("#seek"))
    assert not is_shown("#spawn-ego") and not is_shown("#destroy")
    label = lambda tile: frame_of(browser.text(f".tile:nth-of-type({tile}) .bar span"))
    browser.until("an image", lambda: label(1))
    browser.until("a colourful map", lambda: browser.value(COLORS % 0) > 3)
    browser.until("a colourful image", lambda: browser.value(COLORS % 2) > 50)

    assert "paused" in browser.text("#tick"), browser.text("#tick")
    begin, seen = at(), label(1)
    browser.click("#step")
    browser.until("the next frame", lambda: at() > begin)
    browser.until("its image", lambda: label(1) > seen)
    browser.value("(() => { const s = document.querySelector('#seek'); s.value = s.max / 2; s.oninput(); })()")
    browser.until("the middle", lambda: at() > begin + float(browser.value("document.querySelector('#seek').max")) / 3)
    middle = at()
    browser.click("#play")
    browser.until("time that passes", lambda: at() > middle)
    browser.until("the end", lambda: "paused" in browser.text("#tick") and browser.value(
        "document.querySelector('#seek').value === document.querySelector('#seek').max"))
    assert browser.value("document.querySelector('#step').disabled")
    browser.value("(() => { const s = document.querySelector('#seek'); s.value = s.max / 2; s.oninput(); })()")
    browser.until("the middle again", lambda: abs(at() - middle) < 0.06)
    browser.until("its images", lambda: browser.value(COLORS % 2) > 50)


def check(events: list[dict[str, typing.Any]], url: str) -> None:
    """Checks that nothing failed in the page, and that it loaded nothing from elsewhere."""
    loaded = 0
    for event in events:
        params = event.get("params", {})
        assert event["method"] != "Runtime.exceptionThrown", params
        if event["method"] == "Log.entryAdded":
            assert params["entry"]["level"] != "error", params
        if event["method"] == "Network.requestWillBeSent":
            address = params["request"]["url"]
            assert address.startswith((url, "data:", "blob:")), address
            loaded += 1
    assert loaded > 5, loaded


def main() -> None:
    program, url, picture, source = sys.argv[1:]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        browser = Browser(program, folder)
        try:
            look(browser, url, picture, source)
        finally:
            browser.process.terminate()
            browser.process.wait()
    print("seen")


if __name__ == "__main__":
    main()
