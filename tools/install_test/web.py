"""The page of bushd-web, from the package to its first answers."""

import json

from install_test.container import wait_until

GET = """import sys, urllib.request
with urllib.request.urlopen("http://127.0.0.1:8260" + sys.argv[1], timeout=10) as answer:
    print(answer.status, answer.headers["content-type"])
    print(answer.read().decode())"""


def step_page(lab, _):
    """Its files, as a browser on this PC asks for them, and states, as programs read them: by somebody who is not in the group."""

    def get(path):
        """Status and type in one line, and what came. None: refused."""
        ran = lab.run("python3", "-c", GET, path, user="otto", check=False)
        return ran.stdout.partition("\n")[::2] if ran.returncode == 0 else None

    lab.expect(lab.show("User", "bushd-web") == "bushd-web", "bushd-web runs as another user")
    head, page = wait_until("the page", lambda: get("/"))
    lab.expect(head.startswith("200 text/html") and "app.js" in page, f"{head}: {page}")
    for path, kind in (("/app.js", "200 text/javascript"), ("/app.css", "200 text/css")):
        found = get(path)
        lab.expect(found and found[0].startswith(kind), f"{path}: {found and found[0]}")
    # It is 503 until the daemon has said what it has.
    head, state = wait_until("states", lambda: get("/api/state"))
    names = sorted(motor["name"] for motor in json.loads(state)["motors"])
    lab.expect(head == "200 application/json" and {"phi", "theta"} <= set(names), f"{head}: {state}")
    return f"/ and its files, by otto; /api/state has {', '.join(names)}; exposure {lab.exposure('bushd-web')}"
