"""Headless Chromium, told page by page what to open: for tests and benchmarks of the report."""

from __future__ import annotations

import importlib.util
import json
import shutil

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
MISSING = [
    name
    for name, there in (
        ("Chromium (Debian: chromium)", CHROMIUM),
        ("ChromeDriver (Debian: chromium-driver)", DRIVER),
        ('selenium (pip install "impactsig[test]")', importlib.util.find_spec("selenium")),
    )
    if not there
]
SWITCHES = (
    "headless=new no-sandbox disable-gpu disable-quic no-first-run disable-background-networking "
    "disable-component-update disable-sync force-color-profile=srgb window-size=1280,1000"
)
DRAWN = """
const done = arguments[0];
(function look() {
  const waveform = document.querySelector("#waveform");
  const { drawn } = document.documentElement.dataset;
  if (!waveform || drawn) done(Number(drawn ?? performance.now()));
  else requestAnimationFrame(look);
})();
"""


class Browser:
    """A page at a time, with what it told and asked for.

    Attributes
    ----------
    drawn : float
        From the start of the last page's loading until it was drawn [ms].
    """

    def __init__(self):
        from selenium import webdriver
        from selenium.webdriver.chrome.service import Service

        options = webdriver.ChromeOptions()
        options.binary_location = CHROMIUM
        for switch in SWITCHES.split():
            options.add_argument(f"--{switch}")
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        self.driver = webdriver.Chrome(options=options, service=Service(DRIVER))
        self.driver.set_script_timeout(60)

    def open(self, path):
        """Until it is drawn; all that was told and asked for on the way."""
        self.driver.get("about:blank")
        self.driver.get_log("browser"), self.driver.get_log("performance")
        self.driver.get(path.as_uri())
        self.drawn = self.driver.execute_async_script(DRAWN)
        told = [entry for entry in self.driver.get_log("browser") if entry["level"] != "INFO"]
        messages = [json.loads(e["message"])["message"] for e in self.driver.get_log("performance")]
        asked = {
            message["params"]["request"]["url"]
            for message in messages
            if message["method"] == "Network.requestWillBeSent"
        }
        return told, {url for url in asked if not url.startswith(("data:", "blob:"))}

    def run(self, script):
        return self.driver.execute_script(f"return {script}")

    def mouse(self, kind, x, y, **more):
        event = {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1, "buttons": 1}
        if kind in ("mouseReleased", "mouseWheel"):
            event["buttons"] = 0
        if kind == "mouseWheel":
            event["button"] = "none"
        self.driver.execute_cdp_cmd("Input.dispatchMouseEvent", event | more)

    def emulate(self, media="", **features):
        named = [{"name": n.replace("_", "-"), "value": v} for n, v in features.items()]
        settings = {"media": media, "features": named}
        self.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", settings)
