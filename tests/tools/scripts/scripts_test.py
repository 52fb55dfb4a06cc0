"""What scripts and presets promise to whoever runs them first, in any order and on any system."""

import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])


def run(script, *arguments, path):
    return subprocess.run(["/bin/sh", SOURCE / "tools" / script, *arguments], env={"PATH": path}, capture_output=True, text=True, check=False)


class Setup(unittest.TestCase):
    """Of a system without apt, where only these programs are found."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = folder.name
        for name in ("cat", "dirname", "id", "sed"):
            pathlib.Path(self.path, name).symlink_to(f"/usr/bin/{name}")

    def test_without_apt_it_is_one_sentence_at_the_beginning(self):
        for script, *arguments in (("setup",), ("setup", "--package"), ("demo",), ("package",), ("format",)):
            with self.subTest(script=script, arguments=arguments):
                ran = run(script, *arguments, path=self.path)
                self.assertEqual(ran.returncode, 1)
                self.assertEqual(ran.stdout, "")
                self.assertRegex(ran.stderr, r"\Asetup: there is no apt here, .*'tools/setup --list'.*\n\Z")

    def test_what_builds_it_is_listed_once(self):
        ran = run("setup", "--list", path=self.path)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        lists = dict(line.split(": ", 1) for line in ran.stdout.splitlines())
        self.assertIn("liblcm-dev", lists["programs and demo"].split())
        self.assertIn("gcc-avr", lists["tests and firmware"].split())
        # What is found by CMake, and each package of the Debian packages' own list.
        control = (SOURCE / "debian/control").read_text()
        needed = re.search(r"^Build-Depends:\n((?: .*\n)+)", control, re.MULTILINE)[1]
        listed = ran.stdout.split()
        for package in re.findall(r"^ ([a-z0-9.+-]+)", needed, re.MULTILINE):
            if not package.startswith(("debhelper-compat", "dh-sequence-")):
                self.assertIn(package, listed)


class Presets(unittest.TestCase):
    def test_each_configure_states_what_others_may_have_left_out(self):
        """tools/demo leaves out tests and benchmarks, and a cache keeps what nobody states."""
        base = next(preset for preset in json.loads((SOURCE / "CMakePresets.json").read_text())["configurePresets"] if preset["name"] == "base")
        stated = base["cacheVariables"]
        left_out = re.findall(r"-D(BUSHD_\w+)=", (SOURCE / "tools/demo").read_text())
        self.assertGreaterEqual(len(left_out), 2)
        for option in left_out:
            self.assertEqual(stated.get(option), "ON", option)
        self.assertEqual(stated["BUSHD_WERROR"], "$penv{BUSHD_WERROR}")


if __name__ == "__main__":
    unittest.main()
