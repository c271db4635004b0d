"""A page in Chromium, driven over the pipe of its developer tools: scripts, console, requests and pictures."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time

CHROMIUM = shutil.which("chromium")
_ARGUMENTS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --remote-debugging-pipe --hide-scrollbars"
).split()
_LONGEST = 120.0


class Page:
    """A page of a file at a width and height in pixels, from its load on; close it by ``with``."""

    def __init__(self, file, folder, width=1400, height=1000):
        to_browser, from_browser = os.pipe(), os.pipe()
        command = [CHROMIUM, *_ARGUMENTS, f"--user-data-dir={folder}", f"--window-size={width},{height}"]

        def as_three_and_four():
            # above both numbers first, so that none is written over
            inward, outward = os.dup2(to_browser[0], 60), os.dup2(from_browser[1], 61)
            os.dup2(inward, 3)
            os.dup2(outward, 4)

        self._process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=as_three_and_four,
            close_fds=False,
        )  # fmt: skip
        os.close(to_browser[0])
        os.close(from_browser[1])
        self._to, self._from, self._rest, self._count = to_browser[1], from_browser[0], b"", 0
        self.console, self.requests, self._loaded = [], [], False
        target = self._ask("Target.createTarget", {"url": "about:blank"}, session=None)["targetId"]
        attached = self._ask("Target.attachToTarget", {"targetId": target, "flatten": True}, session=None)
        self._session = attached["sessionId"]
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        for method, given in (
            ("Emulation.setDeviceMetricsOverride", metrics), ("Runtime.enable", {}), ("Log.enable", {}),
            ("Network.enable", {}), ("Page.enable", {}), ("Page.navigate", {"url": file.as_uri()}),
        ):  # fmt: skip
            self.ask(method, given)
        self.wait("document.readyState === 'complete'")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()
        os.close(self._to)
        os.close(self._from)

    def ask(self, method, given):
        """The answer to a call of the protocol, in the page."""
        return self._ask(method, given, self._session)

    def _ask(self, method, given, session):
        self._count += 1
        message = {"id": self._count, "method": method, "params": given} | (
            {"sessionId": session} if session else {}
        )
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, answer["error"]
                return answer["result"]

    def _next(self):
        while b"\0" not in self._rest:
            piece = os.read(self._from, 1 << 20)
            assert piece, "the browser has ended"
            self._rest += piece
        text, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(text)
        self._note(message.get("method"), message.get("params", {}))
        return message

    def _note(self, method, given):
        if method == "Runtime.consoleAPICalled":
            self.console.append(
                " ".join(str(each.get("value", each.get("description"))) for each in given["args"])
            )
        elif method == "Runtime.exceptionThrown":
            details = given["exceptionDetails"]
            self.console.append(details.get("exception", {}).get("description", details["text"]))
        elif method == "Log.entryAdded":
            self.console.append(given["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(given["request"]["url"])

    def evaluate(self, script):
        """The value of an expression in the page, awaited where it is a promise."""
        given = {"expression": script, "returnByValue": True, "awaitPromise": True}
        answer = self.ask("Runtime.evaluate", given)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition):
        """Wait until an expression holds in the page."""
        end = time.monotonic() + _LONGEST
        while not self.evaluate(f"Boolean({condition})"):
            assert time.monotonic() < end, f"{condition} does not come true: {self.console}"
            time.sleep(0.02)

    def picture(self, file, whole=True):
        """Write a picture of the page."""
        answer = self.ask("Page.captureScreenshot", {"captureBeyondViewport": whole} | self._clip(whole))
        file.write_bytes(base64.b64decode(answer["data"]))

    def _clip(self, whole):
        if not whole:
            return {}
        size = self.ask("Page.getLayoutMetrics", {})["cssContentSize"]
        return {"clip": {**{k: size[k] for k in ("x", "y", "width", "height")}, "scale": 1}}
