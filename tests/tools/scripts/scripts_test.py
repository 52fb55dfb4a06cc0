"""What scripts and presets promise to whoever runs them first, in any order and on any system."""

import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
sys.path.insert(0, str(SOURCE / "tools"))
from install_test import debian


def run(script, *arguments, path):
    return subprocess.run(["/bin/sh", SOURCE / "tools" / script, *arguments], env={"PATH": path}, capture_output=True, text=True, check=False)


class Setup(unittest.TestCase):
    """A system without apt, where only these programs are found."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = folder.name
        for name in ("cat", "dirname", "id", "sed"):
            pathlib.Path(self.path, name).symlink_to(f"/usr/bin/{name}")

    def test_without_apt_it_is_one_sentence_at_the_beginning(self):
        for script, *arguments in (("setup",), ("setup", "--package"), ("setup", "--web"), ("setup", "--web-tests"), ("demo",), ("package",), ("format",)):
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


class Mirror(unittest.TestCase):
    """From where tools/test-on and tools/test-install make a Debian."""

    def mirror(self, **files):
        with tempfile.TemporaryDirectory() as folder:
            etc = pathlib.Path(folder)
            (etc / "apt/sources.list.d").mkdir(parents=True)
            for name, text in files.items():
                (etc / "apt/sources.list.d" / name.replace("_", ".")).write_text(text)
            return debian.mirror_of_this_pc(etc)

    def test_only_the_folder_debian_with_main_is_one(self):
        others = (
            "deb https://packages.example.org/debian-tools stable main\n"
            "deb http://deb.debian.org/debian-security trixie-security main\n"
            "deb [arch=amd64] https://download.example.org/linux/debian trixie stable\n"
            "# deb http://old.example.org/debian trixie main\n"
        )
        self.assertEqual(self.mirror(a_list=others), [])
        self.assertEqual(self.mirror(a_list=others, b_list="deb [signed-by=/x y=z] http://one.example.org/debian/ trixie main contrib\n"),
                         ["http://one.example.org/debian/"])

    def test_either_form_and_the_first_file_by_name(self):
        off = "Types: deb\nEnabled: no\nURIs: http://off.example.org/debian\nSuites: trixie\nComponents: main\n"
        sources = "Types: deb-src\nURIs: http://src.example.org/debian\nSuites: trixie\nComponents: main\n"
        on = "Types: deb deb-src\nURIs: http://x.example.org/other http://on.example.org/debian\nSuites: trixie\nComponents: main\n"
        last = "deb http://last.example.org/debian trixie main\n"
        self.assertEqual(self.mirror(a_sources=f"{off}\n{sources}\n{on}", b_list=last, a_save=last), ["http://on.example.org/debian"])
        self.assertEqual(self.mirror(c_sources=on, b_list=last), ["http://last.example.org/debian"])


class Presets(unittest.TestCase):
    def test_each_configure_states_what_others_may_have_left_out(self):
        """tools/demo leaves out tests and benchmarks, and a cache keeps what nobody states."""
        base = next(preset for preset in json.loads((SOURCE / "CMakePresets.json").read_text())["configurePresets"] if preset["name"] == "base")
        stated = base["cacheVariables"]
        told = "".join(page.read_text() for page in [SOURCE / "tools/demo", *SOURCE.glob("*.md"), *SOURCE.glob("docs/*.md")])
        configures = re.findall(r"cmake --preset (?:\\\n|[^\n`&])*", told)
        self.assertGreaterEqual(len(configures), 3)
        # With -B it is another folder, which no preset finds.
        left_out = {option for line in configures if " -B " not in line for option in re.findall(r"-D(BUSHD_\w+)=", line)}
        self.assertLessEqual({"BUSHD_TESTS", "BUSHD_BENCHMARKS"}, left_out)
        for option in left_out:
            self.assertEqual(stated.get(option), "ON", option)
        self.assertEqual(stated["BUSHD_WERROR"], "$penv{BUSHD_WERROR}")


if __name__ == "__main__":
    unittest.main()
