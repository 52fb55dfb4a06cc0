"""docs/bluesky.md as a user goes through it: its commands, and its programs one after the other as in a notebook."""

import re
import shlex
import subprocess
import sys

from lab import TOP, BlueskyTest, main

PAGE = (TOP / "docs/bluesky.md").read_text()


class Page(BlueskyTest):
    def test_the_page_does_what_it_says(self):
        text = (TOP / "tools/examples/first.toml").read_text()
        for here, there in (("/tmp/bushd-control", self.file("control")), ("/tmp/bushd-bus", self.file("port"))):
            text = text.replace(f'"{here}"', f'"{there}"')
        self.file("bushd.toml").write_text(text)
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.command("status", "--wait-s", "30")
        for line in re.findall(r"^    (bushctl .*)$", PAGE, re.MULTILINE):
            self.command(*shlex.split(line)[1:])
        programs = re.findall(r"^```python\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
        self.assertEqual(len(programs), 4)
        script = self.file("page.py")
        script.write_text("\n".join(programs))
        ran = subprocess.run([sys.executable, "-B", script], capture_output=True, text=True, check=False, timeout=300)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        shown = re.search(r"^prints\n\n    (.*)$", PAGE, re.MULTILINE)[1]
        self.assertEqual(ran.stdout.strip(), shown)
        self.assertEqual([self.positions()[name] for name in ("theta", "phi")], [0, 20])
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)


if __name__ == "__main__":
    main()
