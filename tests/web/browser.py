"""What the tests with a browser share: Chromium as Debian has it, steered by playwright.

They need what tools/setup --web --web-tests installs; $BUSHD_WEB_PYTHON is the Python of another environment. Without they are skipped,
unless $BUSHD_WEB_TESTS says that it is required, as tools/test --ci does.
"""

import contextlib
import functools
import os
import pathlib
import re
import signal
import sys
import unittest

from lab import TOP, WebTest

PYTHON = pathlib.Path(os.environ.get("BUSHD_WEB_PYTHON", TOP / "build/web-tests/bin/python"))
CHROMIUM = pathlib.Path(os.environ.get("CHROMIUM", "/usr/bin/chromium"))
PAGE = TOP / "build/web"
WITHOUT = "no page, Chromium or playwright: run tools/setup --web --web-tests"
GIVE_UP_MS = 60_000
# Chromium names each connection that fails, and each answer that is a refusal, as an error. The page tells people in its own words.
REFUSED_CONNECTION = r"WebSocket connection to '[^']*' failed"
REFUSED_TOKEN = r"Failed to load resource: the server responded with a status of 403"

_of_all_tests = contextlib.ExitStack()


def main():
    """Runs the tests of the calling script by the Python of the environment."""
    if PYTHON.exists() and os.path.realpath(sys.prefix) != os.path.realpath(PYTHON.parents[1]):
        os.execv(PYTHON, [str(PYTHON), "-B", *sys.argv])
    if os.environ.get("BUSHD_WEB_TESTS") == "required" and not browser_is_there():
        sys.exit(WITHOUT)
    with _of_all_tests:
        unittest.main()


def browser_is_there():
    try:
        import playwright
    except ImportError:
        return False
    return CHROMIUM.exists() and (PAGE / "index.html").exists()


def descendants(pid):
    """Processes that this one has begun, and those that they have."""
    parents = {}
    for status in pathlib.Path("/proc").glob("[0-9]*/status"):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            text = status.read_text()
            parents[int(status.parent.name)] = int(re.search(r"^PPid:\t(\d+)$", text, re.MULTILINE)[1])
    found, new = set(), {pid}
    while new:
        new = {child for child, parent in parents.items() if parent in new}
        found |= new
    return found


@functools.cache
def chromium():
    """One of all tests of a script: it takes a core for seconds to start. Each test has windows of its own."""
    from playwright.sync_api import sync_playwright

    playwright = _of_all_tests.enter_context(sync_playwright())
    # Tests may run as root, where Chromium's own sandbox does not. Without a GPU it need not be looked for.
    browser = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox", "--disable-gpu"])
    _of_all_tests.callback(browser.close)
    return browser


@unittest.skipUnless(browser_is_there(), WITHOUT)
class BrowserTest(WebTest):
    def setUp(self):
        super().setUp()
        self.faults = []  # what Chromium calls an error, and exceptions of the page
        self.expected_faults = []
        self.windows = []
        self.addCleanup(self._assert_no_faults)
        self.addCleanup(self.close_windows)

    def _assert_no_faults(self):
        self.assertEqual([fault for fault in self.faults if not any(re.search(one, fault) for one in self.expected_faults)], [])

    def expect_cut(self):
        """From now on pages may try in vain to connect."""
        self.expected_faults.append(REFUSED_CONNECTION)

    def page_folder(self):
        return PAGE

    def open_window(self, token=None, **options):
        """Its cookies are not those of other windows."""
        window = chromium().new_context(**options)
        self.windows.append(window)
        window.set_default_timeout(GIVE_UP_MS)
        if token is not None:
            name, _, value = self.log_in(token).partition("=")
            window.add_cookies([{"name": name, "value": value, "url": self.address()}])
        return window

    def open_tab(self, view="", token=None, window=None, **options):
        """A page in a window of its own, if none is given; `view`: such as motor/bushd/a0."""
        tab = (window or self.open_window(token, **options)).new_page()
        tab.on("pageerror", lambda error: self.faults.append(str(error)))
        tab.on("console", lambda message: self.faults.append(message.text) if message.type == "error" else None)
        tab.goto(self.address(view))
        return tab

    def address(self, view=""):
        return f"http://127.0.0.1:{self.port}/#/{view}"

    def go_to_view(self, tab, view):
        """As a link would lead there: the page stays."""
        tab.evaluate("view => { location.hash = '#/' + view; }", view)

    def close_windows(self):
        while self.windows:
            self.windows.pop().close()

    def end_programs(self):
        """Tabs before them, so that none misses its server."""
        self.close_windows()
        super().end_programs()

    # -- what a tab shows

    def row(self, tab, motor):
        return tab.get_by_test_id(f"motor-{motor}")

    def wait_for_text(self, place, expected):
        """`place`: what playwright found; `expected`: a text, or a pattern that is to be found in it."""
        from playwright.sync_api import expect

        expect(place).to_have_text(expected, timeout=GIVE_UP_MS)

    def wait_for_part(self, place, expected):
        from playwright.sync_api import expect

        expect(place).to_contain_text(expected, timeout=GIVE_UP_MS)

    def wait_for_class(self, place, name, there=True):
        from playwright.sync_api import expect

        wanted = re.compile(rf"(^|\s){name}(\s|$)")
        (expect(place).to_have_class if there else expect(place).not_to_have_class)(wanted, timeout=GIVE_UP_MS)

    # -- processes of Chromium

    def browser_processes(self, kind=None):
        """All of them, or those of one kind, such as renderer."""
        found = []
        for pid in descendants(os.getpid()):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                words = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode().split()
                if words and "chromium" in words[0] and (kind is None or f"--type={kind}" in words):
                    found.append(pid)
        return found

    def freeze_browser(self):
        """As a phone that sleeps: none of its processes does anything until it is woken."""
        for pid in self.browser_processes():
            os.kill(pid, signal.SIGSTOP)
        self.addCleanup(self.wake_browser)

    def wake_browser(self):
        for pid in self.browser_processes():
            os.kill(pid, signal.SIGCONT)

    # -- what the daemon was asked

    def requests(self, log="moves.jsonl", client=""):
        """Requests of pages in the log of moves; those of one token if `client` names it."""
        return [event for event in self.logged(log) if event["event"] == "request" and event["client"].startswith(f"web:{client}")]
