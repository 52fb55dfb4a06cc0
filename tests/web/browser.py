"""What the tests with a browser share: Chromium as Debian has it, steered by playwright.

They need the page (tools/setup --web), Chromium (tools/setup --pictures) and the environment that tools/setup --web-tests makes;
$BUSHD_WEB_PYTHON is the Python of another one. Without one of them they are skipped.
"""

import os
import pathlib
import sys
import unittest

from lab import TOP, WebTest

PYTHON = pathlib.Path(os.environ.get("BUSHD_WEB_PYTHON", TOP / "build/web-tests/bin/python"))
CHROMIUM = pathlib.Path(os.environ.get("CHROMIUM", "/usr/bin/chromium"))
PAGE = TOP / "build/web"
WITHOUT = "no page, Chromium or playwright: run tools/setup --web --pictures --web-tests"
GIVE_UP_MS = 60_000


def main():
    """Runs the tests of the calling script by the Python of the environment."""
    if PYTHON.exists() and os.path.realpath(sys.prefix) != os.path.realpath(PYTHON.parents[1]):
        os.execv(PYTHON, [str(PYTHON), "-B", *sys.argv])
    unittest.main()


def browser_is_there():
    try:
        import playwright
    except ImportError:
        return False
    return CHROMIUM.exists() and (PAGE / "index.html").exists()


@unittest.skipUnless(browser_is_there(), WITHOUT)
class BrowserTest(WebTest):
    def page_folder(self):
        return PAGE

    def start_browser(self):
        from playwright.sync_api import sync_playwright

        self._playwright = sync_playwright().start()
        self.addCleanup(self._playwright.stop)
        # Tests may run as root, where Chromium's own sandbox does not.
        self.browser = self._playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        self.addCleanup(self.browser.close)

    def open_tab(self, path="", token=None, **options):
        """A page in a window of its own: its cookies are not those of others."""
        window = self.browser.new_context(**options)
        if token is not None:
            name, _, value = self.log_in(token).partition("=")
            window.add_cookies([{"name": name, "value": value, "url": f"http://127.0.0.1:{self.port}/"}])
        tab = window.new_page()
        tab.set_default_timeout(GIVE_UP_MS)
        self.faults = []
        tab.on("pageerror", lambda error: self.faults.append(str(error)))
        tab.on("console", lambda message: self.faults.append(message.text) if message.type == "error" else None)
        tab.goto(f"http://127.0.0.1:{self.port}/{path}")
        return tab
