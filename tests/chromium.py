"""A headless Chromium that tests drive through its debugging pipe: nothing else is needed, and no port is opened."""

import fcntl
import json
import os
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from tests.patience import HANGS

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
QUIET = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars")
OFFLINE = ("--host-resolver-rules=MAP * ~NOTFOUND", "--proxy-server=127.0.0.1:9", "--disable-background-networking")


def command():
    """A command that runs Chromium, or None: from the path, or one that Playwright has fetched."""
    cached = Path(os.environ.get("PLAYWRIGHT_BROWSERS_PATH", Path.home() / ".cache" / "ms-playwright"))
    patterns = ("chromium-*/chrome-linux*/chrome", "chromium_headless_shell-*/chrome-linux*/headless_shell")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    return found or next((str(path) for pattern in patterns for path in sorted(cached.glob(pattern))), None)


class Page:
    """The only page of a browser, with what it has asked for and complained about since it was opened."""

    def __init__(self, profile):
        found = command()
        if found is None:
            pytest.skip("no Chromium, Chrome or Edge found")
        read, self._to = os.pipe()
        self._from, write = os.pipe()

        def connect():
            """Give Chromium its ends of the pipes as 3 and 4, where it expects them."""
            ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (read, write)]
            for place, end in enumerate(ends, 3):
                os.dup2(end, place)

        words = (found, *QUIET, *OFFLINE, f"--user-data-dir={profile}", "--remote-debugging-pipe", "about:blank")
        self._process = subprocess.Popen(words, preexec_fn=connect, close_fds=False, stderr=subprocess.DEVNULL)
        os.close(read)
        os.close(write)
        self._number, self._session, self._rest, self.requests, self.complaints, self._loaded = 0, None, b"", [], [], 0
        (target,) = [t for t in self.send("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        self._session = self.send("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.send(f"{domain}.enable")

    def close(self):
        self._session = None
        self.send("Browser.close")
        self._process.wait(HANGS)
        os.close(self._to)
        os.close(self._from)

    def send(self, method, **parameters):
        """Send a command of Chrome's DevTools protocol, and return its result."""
        self._number += 1
        session = {"sessionId": self._session} if self._session else {}
        message = {"id": self._number, "method": method, "params": parameters, **session}
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    def _next(self):
        """Return the next message, and take note of it if it is an event."""
        while b"\0" not in self._rest:
            part = os.read(self._from, 1 << 20)
            assert part, "Chromium ended"
            self._rest += part
        text, _, self._rest = self._rest.partition(b"\0")
        message = json.loads(text)
        event, what = message.get("method"), message.get("params")
        if event == "Network.requestWillBeSent":
            self.requests.append(what["request"]["url"])
        elif event == "Runtime.exceptionThrown":
            self.complaints.append(what["exceptionDetails"])
        elif event == "Log.entryAdded":
            self.complaints.append(what["entry"])
        elif event == "Runtime.consoleAPICalled" and what["type"] in ("error", "warning", "assert"):
            self.complaints.append(what)
        elif event == "Page.loadEventFired":
            self._loaded += 1
        return message

    def open(self, url):
        """Open a page, and wait until all that belongs to it is there."""
        before = self._loaded
        self.send("Page.navigate", url=url)
        while self._loaded == before:
            self._next()

    def value(self, expression):
        """Return the value of an expression in JavaScript, awaited if it is a promise."""
        found = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait(self, condition):
        """Wait until a condition in JavaScript holds."""
        end = time.monotonic() + HANGS
        while not self.value(f"Boolean({condition})"):
            assert time.monotonic() < end, condition
            time.sleep(0.05)

    def screen(self, width, height=800, scheme="light"):
        """Set the size of the window in pixels, and the colours that the user prefers."""
        self.send("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.send("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def press(self, key, text=""):
        """Press and release a key."""
        what = {"key": key, "code": key, "windowsVirtualKeyCode": {"Enter": 13, "Tab": 9}.get(key, 0)}
        self.send("Input.dispatchKeyEvent", type="keyDown", **what, **({"text": text} if text else {}))
        self.send("Input.dispatchKeyEvent", type="keyUp", **what)
