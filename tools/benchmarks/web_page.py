"""What the page of bushd-web costs a browser, and how fast it stops: Chromium as Debian has it.

    tests/tools/with-loopback-multicast build/web-tests/bin/python tools/benchmarks/web_page.py

Needs what tools/setup --web --web-tests installs. The daemon and its buses are those of many_motors.py. Esc is a key that Chromium is given
as from a keyboard; its time is that of the browser's event, and the request's is in the log of moves, of the same clock.
"""

import argparse
import contextlib
import json
import os
import pathlib
import random
import statistics
import sys
import time

from many_motors import BIN, TOP, used
from web import Lab

sys.path[:0] = [str(TOP / "tests/web"), str(TOP / "tests/e2e")]
from browser import CHROMIUM, PAGE, descendants

NOTE_KEYS = """
window.pressed = [];
window.addEventListener("keydown", (event) => {
  if (event.key === "Escape") window.pressed.push(performance.timeOrigin + event.timeStamp);
}, { capture: true });
"""
CLOCKS_APART = "() => Math.abs(performance.timeOrigin + performance.now() - Date.now())"
ONE_SHOWN = "one of them shown"
GIVE_UP_S = 60
PAINT = "() => performance.getEntriesByName('first-contentful-paint')[0]?.startTime ?? null"


def chromium(playwright):
    # As root Chromium's own sandbox does not run.
    return contextlib.closing(playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"]))


class PageLab(Lab):
    """With a log of moves."""

    def start(self, *command):
        more = ("--move-log", self.file("moves.jsonl")) if command[0] == BIN / "bushd" else ()
        return super().start(*command, *more)

    def file(self, name):
        return self.folder / name

    def address(self, view=""):
        return f"http://127.0.0.1:{self.port}/#/{view}"

    def stops_us(self):
        events = [json.loads(line) for line in self.file("moves.jsonl").read_text().splitlines()]
        return [event["utime_us"] for event in events
                if event["event"] == "request" and event["request"] == "stop" and event["client"].startswith("web:")]


def chromium_kinds():
    """Processes of Chromium by kind."""
    found = {}
    for pid in descendants(os.getpid()):
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            words = pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode().split()
            if words and "chromium" in words[0]:
                kind = next((word.partition("=")[2] for word in words if word.startswith("--type=")), "browser")
                found[pid] = kind
    return found


def measure(what, seconds):
    """The busiest renderer is the page's."""
    kinds = chromium_kinds()
    before, began_s = {pid: used(pid)[0] for pid in kinds}, time.monotonic()
    time.sleep(seconds)
    passed_s = time.monotonic() - began_s
    shares = {pid: (used(pid)[0] - before[pid]) / passed_s for pid in kinds}
    page = max(share for pid, share in shares.items() if kinds[pid] == "renderer")
    print(f"{what}: renderer {100 * page:.1f} % of a core, all of Chromium {100 * sum(shares.values()):.1f} %", flush=True)


def at(share, values):
    return sorted(values)[min(int(share * len(values)), len(values) - 1)]


def first_paint(browser, lab, loads=5):
    paints = []
    for _ in range(loads):
        window = browser.new_context()
        tab = window.new_page()
        tab.goto(lab.address())
        tab.get_by_test_id("motor-m0").wait_for()
        paints.append(tab.evaluate(PAINT))
        window.close()
    print(f"first contentful paint: median {statistics.median(paints):.0f} ms, longest {max(paints):.0f} ms of {loads} loads", flush=True)


def open_hidden(browser, lab, count):
    """Tabs of another window, behind an empty one: those that playwright opens are each drawn as if somebody looked at it."""
    session = browser.new_browser_cdp_session()
    for number in range(count):
        session.send("Target.createTarget", {"url": lab.address(f"motor/bushd/m{number}"), "newWindow": number == 0})
    empty = session.send("Target.createTarget", {"url": "about:blank"})
    session.send("Target.activateTarget", {"targetId": empty["targetId"]})
    until_s = time.monotonic() + GIVE_UP_S
    while sum(target["title"].endswith("bushd") for target in session.send("Target.getTargets")["targetInfos"]) < count:
        if time.monotonic() > until_s:
            sys.exit(f"the {count} tabs do not come up")
        time.sleep(0.1)


def open_shown(window, lab, number):
    tab = window.new_page()
    tab.add_init_script(NOTE_KEYS)
    tab.goto(lab.address(f"motor/bushd/m{number}"))
    tab.get_by_test_id("position").wait_for()
    return tab


def esc(browser, lab, options, how):
    window = browser.new_context()
    others = options.tabs - 1
    if how == ONE_SHOWN:
        open_hidden(browser, lab, others)
    else:
        for number in range(others):
            open_shown(window, lab, number)
    tab = open_shown(window, lab, others)
    generator = random.Random(39)
    before = len(lab.stops_us())
    for _ in range(options.presses):
        lab.move_all()
        tab.wait_for_timeout(generator.uniform(250, 450))  # at any phase of reports and frames
        tab.keyboard.press("Escape")
        tab.get_by_test_id("stop-said").filter(has_text="done").wait_for()
    apart_ms = tab.evaluate(CLOCKS_APART)
    pressed_ms = tab.evaluate("() => window.pressed")
    stops_us = lab.stops_us()[before:]
    if len(stops_us) != len(pressed_ms):
        sys.exit(f"{len(pressed_ms)} presses, and {len(stops_us)} stops in the log")
    took_ms = [us / 1000 - ms for ms, us in zip(pressed_ms, stops_us)]
    print(f"Esc to the daemon's log, {options.tabs} tabs with plots, {how}, {len(took_ms)} presses: p50 {at(0.5, took_ms):.1f} ms, "
          f"p99 {at(0.99, took_ms):.1f} ms, longest {max(took_ms):.1f} ms (clocks agree to {apart_ms:.1f} ms)", flush=True)
    window.close()


def overview(browser, lab, what, seconds):
    tab = browser.new_page(viewport={"width": 1280, "height": 900})
    tab.goto(lab.address())
    tab.get_by_test_id("motor-m0").wait_for()
    tab.wait_for_timeout(2000)
    measure(f"{what}, overview", seconds)
    tab.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=10, help="of each measurement of processor time")
    parser.add_argument("--mcus", type=int, default=4, help="of each bus, 16 motors each")
    parser.add_argument("--tabs", type=int, default=10)
    parser.add_argument("--presses", type=int, default=200)
    options = parser.parse_args()
    from playwright.sync_api import sync_playwright

    packed = sum(file.stat().st_size for file in PAGE.glob("*.gz"))
    print(f"page: {packed / 1024:.1f} KiB gzipped, of {len(list(PAGE.glob('*.gz')))} files", flush=True)
    with sync_playwright() as playwright:
        with chromium(playwright) as browser:
            with PageLab(options, 1) as lab:
                first_paint(browser, lab)
                lab.move_all()
                overview(browser, lab, f"{lab.motors} motors moving", options.seconds)
            with PageLab(options, 8) as lab:
                overview(browser, lab, f"{lab.motors} motors at rest", options.seconds)
        for how in (ONE_SHOWN, "each drawn"):
            with chromium(playwright) as browser, PageLab(options, 1) as lab:
                esc(browser, lab, options, how)


if __name__ == "__main__":
    main()
