"""Controls headless Chromium through its DevTools protocol: opens pages, records their logs and requests, and sends
input.
"""

import base64
import json
import os
import subprocess
import tempfile
import time
from pathlib import Path

import websocket

FLAGS = [
    "--headless", "--no-sandbox", "--no-first-run", "--disable-quic", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--disable-extensions", "--disable-default-apps", "--disable-dev-shm-usage", "--hide-scrollbars", "--remote-debugging-port=0",
    "--remote-allow-origins=*",
]
# Options to render WebGL in software, and options without WebGL. GPU compositing is disabled, so that the page itself
# is drawn without WebGL's renderer. This takes half of the time.
WITH_WEBGL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
WITHOUT_WEBGL = ["--disable-gpu", "--disable-3d-apis"]


# A machine under load may take long to start a browser.
START_SECONDS, START_ATTEMPTS = 60, 3


class Browser:
    """A browser with one page."""

    def __init__(self, flags):
        self.folder = tempfile.TemporaryDirectory(prefix="orthowear-browser-", ignore_cleanup_errors=True)
        port_file = Path(self.folder.name) / "DevToolsActivePort"
        for _ in range(START_ATTEMPTS):
            port_file.unlink(missing_ok=True)
            self.process = subprocess.Popen(
                ["chromium", *FLAGS, *flags, f"--user-data-dir={self.folder.name}", "about:blank"],
                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, "TMPDIR": self.folder.name},
            )
            if self.listens(port_file):
                break
            self.process.kill()
            self.process.wait()
        else:
            raise RuntimeError(f"chromium does not start (exit code {self.process.returncode})")
        port, path = port_file.read_text().split("\n")[:2]
        self.socket = websocket.create_connection(f"ws://127.0.0.1:{port}{path}", timeout=40, max_size=None)
        self.number, self.session, self.logged, self.asked = 0, None, [], []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ["Page", "Runtime", "Log", "Network"]:
            self.call(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.folder.cleanup()

    def listens(self, port_file):
        """Whether the process writes its port within START_SECONDS."""
        deadline = time.monotonic() + START_SECONDS
        while time.monotonic() < deadline and self.process.poll() is None:
            if port_file.exists() and port_file.read_text().count("\n") >= 1:
                return True
            time.sleep(0.05)
        return False

    def call(self, method, **parameters):
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.socket.send(json.dumps(message))
        while True:
            answer = json.loads(self.socket.recv())
            if answer.get("id") == self.number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self.note(answer)

    def note(self, event):
        """Records log entries and requests of the page."""
        what, said = event.get("method"), event.get("params", {})
        if what == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning", "assert"):
            self.logged.append(f"{said['type']}: " + " ".join(str(a.get("value", a.get("description"))) for a in said["args"]))
        elif what == "Runtime.exceptionThrown":
            details = said["exceptionDetails"]
            self.logged.append("exception: " + details.get("exception", {}).get("description", details["text"]))
        elif what == "Log.entryAdded" and said["entry"]["level"] in ("error", "warning"):
            # Software rendering logs this text when the tests read pixels of the 3D view.
            if "GPU stall due to ReadPixels" not in said["entry"]["text"]:
                self.logged.append(f"{said['entry']['level']}: {said['entry']['text']}")
        elif what == "Network.requestWillBeSent":
            self.asked.append(said["request"]["url"])

    def size(self, width, height):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def open(self, path):
        """Opens a file and waits until it is loaded. Deletes earlier records first."""
        self.logged, self.asked = [], []
        self.call("Page.navigate", url=Path(path).resolve().as_uri())
        deadline = time.monotonic() + 30
        while not self.value("document.readyState === 'complete' && location.protocol === 'file:'"):
            if time.monotonic() > deadline:
                raise RuntimeError(f"{path} does not load")
            time.sleep(0.03)

    def value(self, expression):
        """Evaluates an expression in the page, and returns its value."""
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            raise RuntimeError(f"{expression}: {result['exceptionDetails']['exception'].get('description')}")
        return result["result"].get("value")

    def move(self, x, y):
        self.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)

    def key(self, name, code):
        for kind in ["rawKeyDown", "keyUp"]:
            self.call("Input.dispatchKeyEvent", type=kind, key=name, code=name, windowsVirtualKeyCode=code)

    def picture(self, path, whole=False):
        """Writes a screenshot as PNG. `whole` states whether the picture includes parts outside of the window."""
        options = {"captureBeyondViewport": True} if whole else {}
        if whole:
            size = self.call("Page.getLayoutMetrics")["cssContentSize"]
            options["clip"] = {"x": 0, "y": 0, "width": size["width"], "height": size["height"], "scale": 1}
        Path(path).write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png", **options)["data"]))

    def pdf(self):
        return base64.b64decode(self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)["data"])
