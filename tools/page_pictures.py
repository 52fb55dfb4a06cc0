"""The pictures of docs/web.md, for tools/pictures --page: Chromium, as tools/setup --web-tests installs what steers it, at the page of a
daemon whose motors stand where they always do. What moves in them (a plot, a clock) is as it was that time."""

import contextlib
import pathlib
import socket
import subprocess
import sys

from playwright.sync_api import sync_playwright

CHROMIUM = "/usr/bin/chromium"
TALL = {"viewport": {"width": 1100, "height": 1200}}
VIEWS = {
    "page-overview": ({}, ""),
    "page-overview-dark": ({"color_scheme": "dark"}, ""),
    "page-phone": ({"viewport": {"width": 360, "height": 720}}, ""),
    "page-motor": (TALL, "#/motor/bushd/theta"),
    "page-tables": (TALL, "#/tables"),
    "page-paths": (TALL, "#/paths"),
    "page-health": ({}, "#/health"),
}
PATH = "theta,slit-left\n12.5,4.25\n14,5\n16,9\n13,12\n10,9\n12,5\n12.5,4.25\n"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextlib.contextmanager
def page_of(bushd_web, control, folder, page):
    """A bushd-web, and its address."""
    address = f"127.0.0.1:{free_port()}"
    command = [bushd_web, "--listen", address, "--daemon", f"bushd={control}", "--tokens", folder / "tokens", "--page", page]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        if "the page is at" not in process.stdout.readline():
            sys.exit("pictures: bushd-web does not start")
        yield f"http://{address}/"
    finally:
        process.terminate()
        process.wait()


def prepare(tab, name, bushctl):
    """What somebody does before the picture is taken."""
    if name == "page-motor":
        bushctl("move", "theta", "--to", "40", "--wait")
        bushctl("move", "theta", "--to", "12.5", "--wait")
        tab.wait_for_timeout(500)
    elif name == "page-tables":
        for box in tab.get_by_role("checkbox").all()[:3]:
            box.check()
        tab.wait_for_timeout(500)
    elif name == "page-paths":
        tab.locator("input[type=file]").set_input_files({"name": "loop.csv", "mimeType": "text/csv", "buffer": PATH.encode()})
        tab.wait_for_timeout(1000)
    elif name == "page-health":
        tab.wait_for_timeout(5000)  # the doctor looks at buses for two seconds


def write(pictures, bushd_web, control, folder, page, token, bushctl):
    with page_of(bushd_web, control, folder, page) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--hide-scrollbars"])
        for name, (options, view) in VIEWS.items():
            window = browser.new_context(**{"viewport": {"width": 1100, "height": 760}, **options})
            window.request.post(f"{address}api/login", data={"token": token})
            tab = window.new_page()
            tab.goto(address + view)
            tab.get_by_text("connected").first.wait_for()
            tab.wait_for_timeout(1000)
            prepare(tab, name, bushctl)
            tab.screenshot(path=pathlib.Path(pictures) / f"{name}.png")
            window.close()
        browser.close()
