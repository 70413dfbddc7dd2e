"""A headless Chromium driven through the WebDriver protocol of chromedriver: plain HTTP and JSON, no library."""

import base64
import json
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request

import pytest

CHROMIUM = shutil.which("chromium")
DRIVER = shutil.which("chromedriver")
needs_browser = pytest.mark.skipif(
    not (CHROMIUM and DRIVER), reason="needs Debian's packages chromium and chromium-driver"
)
ARGUMENTS = (
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--disable-dev-shm-usage", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--hide-scrollbars", "--force-prefers-reduced-motion",
)  # fmt: skip


class Browser:
    """One browser window. Closed by `close`."""

    def __init__(self, profile, width=1100, height=900):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self.at = f"http://127.0.0.1:{port}"
        self.driver = subprocess.Popen([DRIVER, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            self._wait_for_driver()
            options = {
                "binary": CHROMIUM,
                "args": [*ARGUMENTS, f"--user-data-dir={profile}", f"--window-size={width},{height}"],
            }
            wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
            session = self._call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
            self.session = f"/session/{session['sessionId']}"
            self._call("POST", f"{self.session}/timeouts", {"script": 60_000, "pageLoad": 60_000})
        except BaseException:
            self.driver.kill()
            raise

    def _wait_for_driver(self):
        for _ in range(300):
            try:
                if self._call("GET", "/status")["ready"]:
                    return
            except OSError:
                time.sleep(0.1)
        raise TimeoutError("chromedriver does not answer")

    def _call(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.at + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(error.read().decode()) from error

    def open(self, path):
        """Open a file and wait until its script is done."""
        self._call("POST", f"{self.session}/url", {"url": path.resolve().as_uri()})
        for _ in range(600):
            if self.run("return document.body && document.body.dataset.ready === 'yes'"):
                return
            time.sleep(0.1)
        raise TimeoutError(f"the script of {path.name} does not end: {self.console()}")

    def run(self, script, *args):
        """The value that JavaScript returns."""
        return self._call("POST", f"{self.session}/execute/sync", {"script": script, "args": list(args)})

    def console(self):
        """Messages of the console since the last call, warnings and errors only."""
        entries = self._call("POST", f"{self.session}/se/log", {"type": "browser"})
        return [e["message"] for e in entries if e["level"] in ("WARNING", "SEVERE")]

    def press(self, element_id, *keys):
        """Focus an element and press keys on it."""
        found = self._call("POST", f"{self.session}/element", {"using": "css selector", "value": f"#{element_id}"})
        element = next(iter(found.values()))
        self._call("POST", f"{self.session}/element/{element}/value", {"text": "".join(keys)})

    def tab(self):
        """Press the tab key and return the id or tag of the element with the focus."""
        keys = [{"type": "keyDown", "value": "\ue004"}, {"type": "keyUp", "value": "\ue004"}]
        self._call("POST", f"{self.session}/actions", {"actions": [{"type": "key", "id": "k", "actions": keys}]})
        return self.run("const e = document.activeElement; return e.id || e.tagName")

    def resize(self, width, height):
        """Set the size of the window."""
        self._call("POST", f"{self.session}/window/rect", {"width": width, "height": height})

    def screenshot(self):
        """PNG bytes of the window."""
        return base64.b64decode(self._call("GET", f"{self.session}/screenshot"))

    def pdf(self):
        """PDF bytes of the page as printed on A4."""
        page = {"page": {"width": 21.0, "height": 29.7}, "background": False}
        return base64.b64decode(self._call("POST", f"{self.session}/print", page))

    def close(self):
        """End the browser and its driver."""
        try:
            self._call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait(10)
