#!/usr/bin/env python3
"""One version everywhere, one layout of `cmake --install` and packages, headers that are complete, and bushd-flash.

$BUSHD_SOURCE_DIR is the source tree, $BUSHD_BUILD_DIR the build, $BUSHD and $CMAKE are programs."""

import fnmatch
import os
import pathlib
import re
import stat
import subprocess
import tempfile
import unittest
import zlib

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ["BUSHD_BUILD_DIR"])


def project_version():
    return re.search(r"^project\(bushd VERSION ([0-9.]+)", (SOURCE / "CMakeLists.txt").read_text(), re.MULTILINE)[1]


class Version(unittest.TestCase):
    def test_is_that_of_the_newest_entry_of_the_changelog_of_packages(self):
        entry = re.match(r"bushd \((.*?)\) ", (SOURCE / "debian/changelog").read_text())
        self.assertEqual(entry[1], project_version(), "debian/changelog and project(VERSION) of CMakeLists.txt differ")

    def test_is_what_the_program_says(self):
        said = subprocess.run([os.environ["BUSHD"], "--version"], capture_output=True, text=True, check=True).stdout
        self.assertIn(project_version(), said)


class Installation(unittest.TestCase):
    """What `cmake --install` puts below a prefix."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.prefix = pathlib.Path(cls.folder.name)
        command = [os.environ["CMAKE"], "--install", BUILD, "--prefix", cls.prefix]
        subprocess.run(command, capture_output=True, check=True)
        cls.files = {str(path.relative_to(cls.prefix)) for path in cls.prefix.rglob("*") if not path.is_dir()}


class BuiltForAPackage(unittest.TestCase):
    """Packages are built without tests, for which much is made here."""

    def test_the_headers_of_lcm_are_made_for_themselves(self):
        made = subprocess.run(["ninja", "-C", BUILD, "-t", "query", "lib/lcm/all"], capture_output=True, text=True, check=True).stdout
        inputs = made.partition("outputs:")[0].split()
        self.assertIn("lib/lcm/bushd_lcm_headers", inputs)


class Layout(Installation):
    def packaged(self):
        """What the packages take, below a prefix; the images come from builds of their own."""
        for file in sorted((SOURCE / "debian").glob("*.install")):
            if file.name == "bushd-firmware.install":
                continue
            for line in file.read_text().split():
                if line == "usr/share/bushd-web/page":  # the page, which tools/package builds
                    continue
                yield line.removeprefix("usr/").replace("lib/*/", "lib/").replace("${env:SYSTEM_LIBDIR}", "lib")

    def test_packages_take_what_is_there_and_leave_nothing(self):
        taken = set()
        for pattern in self.packaged():
            found = {file for file in self.files if fnmatch.fnmatch(file, pattern) or file.startswith(pattern + "/")}
            self.assertTrue(found, f"debian/*.install take {pattern}, and it is not installed")
            taken |= found
        self.assertEqual(self.files - taken, set(), "installed, and in no package")

    def test_a_client_finds_all_headers(self):
        includes = self.prefix / "include"
        for header in [*(includes / "bushd").rglob("*.h")]:
            for named in re.findall(r'^#include "(.*)"', header.read_text(), re.MULTILINE):
                with self.subTest(f"{header.relative_to(includes)} includes {named}"):
                    self.assertTrue((includes / "bushd" / named).exists() or (includes / named).exists())

    def test_units_start_programs_of_this_prefix(self):
        programs = [command for unit in self.prefix.rglob("*.service")
                    for command in re.findall(r"^Exec(?:Start|Stop)=(\S+)", unit.read_text(), re.MULTILINE)]
        self.assertEqual(len(programs), 6)
        for program in programs:
            with self.subTest(program):
                self.assertTrue(pathlib.Path(program).is_relative_to(self.prefix))
                self.assertTrue(os.access(program, os.X_OK))

    def test_the_service_may_open_serial_ports_and_no_consoles(self):
        unit = next(self.prefix.rglob("bushd.service")).read_text()
        allowed = re.findall(r"^DeviceAllow=(\S+) rw$", unit, re.MULTILINE)
        # Majors 4 and 5 are consoles' too; of 4 the minors from 64 on are ttyS0 and those after it.
        self.assertEqual([path for path in allowed if path.startswith("/")], [f"/dev/char/4:{minor}" for minor in range(64, 96)])
        self.assertEqual({path for path in allowed if not path.startswith("/")}, {"char-188", "char-166", "char-204"})

    def test_programs_find_the_tables_of_this_prefix(self):
        command = [self.prefix / "bin/bushtab", "show", "none"]
        ran = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, "BUSHD_TABLES_DIR": ""})
        self.assertIn(f"{self.prefix}/share/bushd/tables", ran.stderr)

    def test_the_demonstration_is_a_good_configuration(self):
        ran = subprocess.run([os.environ["BUSHD"], "--check-config", SOURCE / "daemon/system/demo.toml"], capture_output=True, text=True, check=False)
        self.assertEqual(ran.returncode, 0, ran.stderr)

    def test_manual_pages_are_complete(self):
        for page in (self.prefix / "share/man").rglob("*"):
            if page.is_file():
                with self.subTest(page.name):
                    text = page.read_text()
                    self.assertRegex(text, r"\A('\\\" t\n)?\.TH ")
                    self.assertNotRegex(text, r"@[A-Z]+@")
                    self.assertTrue(text.isascii(), "troff itself reads no UTF-8")

    def test_manual_pages_give_no_warnings(self):
        for page in (self.prefix / "share/man").rglob("*.[1-8]"):
            with self.subTest(page.name):
                ran = subprocess.run(["groff", "-man", "-t", "-ww", "-Tutf8", page], capture_output=True, text=True, check=False)
                self.assertEqual((ran.returncode, ran.stderr), (0, ""))


class Epics(Installation):
    """bushd-epics as it is installed; without caproto, which packages have beside it."""

    def ran(self, *arguments):
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return subprocess.run([self.prefix / "bin/bushd-epics", *arguments], capture_output=True, text=True, env=environment, check=False)

    def test_page_and_help_tell_of_the_same_options(self):
        page = (SOURCE / "docs/man/bushd-epics.1").read_text().replace(r"\-", "-")
        options = set(re.findall(r"^\.TP\n\\fB(--[a-z-]+)", page, re.MULTILINE))
        said = set(re.findall(r"^  (--[a-z-]+)", self.ran("--help").stdout, re.MULTILINE))
        self.assertEqual(options, said)

    def test_without_caproto_it_is_one_sentence(self):
        ran = self.ran("--prefix", "LAB:", "--list")
        self.assertEqual((ran.returncode, ran.stdout, len(ran.stderr.splitlines())), (2, "", 1))
        self.assertIn("caproto", ran.stderr)

    def test_the_unit_waits_for_the_file_that_it_reads(self):
        unit = next(self.prefix.rglob("bushd-epics.service")).read_text()
        (needed,) = re.findall("^ConditionPathExists=(.*)$", unit, re.MULTILINE)
        self.assertEqual(re.findall("^EnvironmentFile=(.*)$", unit, re.MULTILINE), [needed])
        postrm = (SOURCE / "debian/bushd-epics.postrm").read_text()
        self.assertRegex(postrm, rf"rm -f .*{re.escape(needed)}\b", "purge leaves it")

    def test_the_user_of_the_unit_is_made_and_removed(self):
        unit = next(self.prefix.rglob("bushd-epics.service")).read_text()
        (user,) = re.findall("^User=(.*)$", unit, re.MULTILINE)
        made = (self.prefix / "lib/sysusers.d/bushd-epics.conf").read_text()
        self.assertRegex(made, rf"(?m)^u {user} -")
        self.assertRegex(made, rf"(?m)^m {user} bushd$")
        postrm = (SOURCE / "debian/bushd-epics.postrm").read_text()
        for command in ("userdel", "groupdel"):
            self.assertIn(f"{command} {user} ", postrm)


class Web(Installation):
    """bushd-web as it is installed; without its page, which tools/package builds."""

    def setUp(self):
        self.unit = next(self.prefix.rglob("bushd-web.service")).read_text()
        self.postrm = (SOURCE / "debian/bushd-web.postrm").read_text()

    def test_page_and_help_tell_of_the_same_options(self):
        page = (SOURCE / "docs/man/bushd-web.8").read_text().replace(r"\-", "-")
        options = set(re.findall(r"^\.TP\n\\fB(--[a-z-]+)", page, re.MULTILINE))
        ran = subprocess.run([self.prefix / "bin/bushd-web", "--help"], capture_output=True, text=True, check=True)
        said = set(re.findall(r"^  (?:-\w,)?(--[a-z-]+)", ran.stdout, re.MULTILINE))
        self.assertEqual(options, said)

    def test_the_folder_of_tokens_is_that_of_the_programs_and_the_groups(self):
        file = re.search(r'kSystemFile = "(.*)";', (SOURCE / "lib/tokens/token_file.h").read_text())[1]
        folder = str(pathlib.PurePosixPath(file).parent)
        made = (self.prefix / "lib/tmpfiles.d/bushd-web.conf").read_text()
        self.assertRegex(made, rf"(?m)^d {folder} 2770 root bushd$")
        self.assertRegex(self.postrm, rf"rm -rf {folder}\n", "purge leaves it")

    def test_the_user_of_the_unit_is_made_and_removed(self):
        (user,) = re.findall("^User=(.*)$", self.unit, re.MULTILINE)
        self.assertEqual(re.findall("^SupplementaryGroups=(.*)$", self.unit, re.MULTILINE), ["bushd"])
        self.assertRegex((self.prefix / "lib/sysusers.d/bushd-web.conf").read_text(), rf"(?m)^u {user} -")
        for command in ("userdel", "groupdel"):
            self.assertIn(f"{command} {user} ", self.postrm)

    def test_it_starts_without_the_file_of_options_and_purge_removes_that(self):
        (options,) = re.findall("^EnvironmentFile=(.*)$", self.unit, re.MULTILINE)
        self.assertTrue(options.startswith("-/"))
        self.assertIn(f"rm -f {options[1:]}\n", self.postrm)


class Vendored(unittest.TestCase):
    """What packages contain of others."""

    def test_a_missing_file_is_one_sentence_without_a_network(self):
        """As tools/package fetches it: pip is not there, and neither is the file."""
        script = (SOURCE / "tools/package").read_text()
        fetch = re.search(r"^fetch\(\) \{\n.*?^\}\n", script, re.DOTALL | re.MULTILINE)[0]
        with tempfile.TemporaryDirectory() as folder:
            python = pathlib.Path(folder) / "python3"
            python.write_text("#!/bin/sh\necho 'No route to host'\nexit 1\n")
            python.chmod(0o755)
            for content in (None, b"something else"):
                downloads = pathlib.Path(folder) / "downloads"
                downloads.mkdir(exist_ok=True)
                if content:
                    (downloads / "caproto-1.3.0-py3-none-any.whl").write_bytes(content)
                run = f'set -eu; downloads={downloads}; fail() {{ echo "package: $1" >&2; exit 1; }}\n{fetch}fetch'
                ran = subprocess.run(["sh", "-c", run], cwd=SOURCE, env={"PATH": f"{folder}:/usr/bin:/bin"}, capture_output=True, text=True, check=False)
                self.assertEqual(ran.returncode, 1)
                self.assertIn("No route to host", ran.stderr)
                self.assertRegex(ran.stderr, r"package: caproto-\S+\.whl could not be downloaded .* into build/downloads \(sha256 [0-9a-f]{64}\)\n\Z")

    def test_laboratories_programs_are_tried_with_the_same_file(self):
        tried = (SOURCE / "tests/lab_clients/requirements.txt").read_text()
        for line in (SOURCE / "debian/vendored.sha256").read_text().splitlines():
            digest, file = line.split()
            name, version = file.split("-")[:2]
            listed = re.search(rf"^{name}==(\S+)((?:.*\\\n)*.*)$", tried, re.MULTILINE)
            self.assertEqual(listed[1], version)
            self.assertIn(f"--hash=sha256:{digest}", listed[2])

    def test_each_has_a_licence_in_the_copyright_file(self):
        copyrights = (SOURCE / "debian/copyright").read_text()
        for line in (SOURCE / "debian/vendored.sha256").read_text().splitlines():
            self.assertRegex(line, r"^[0-9a-f]{64}  \S+-py3-none-any\.whl$", "sha256sum reads it, and it is for any machine")
            self.assertIn(f"Files: debian/vendored/{line.split()[1].split('-')[0]}-*\n", copyrights)


class Flash(unittest.TestCase):
    """bushd-flash beside images, with an avrdude that writes down how it is called."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.prefix = pathlib.Path(folder.name)
        (self.prefix / "bin").mkdir()
        self.program = self.prefix / "bin/bushd-flash"
        self.program.write_text((SOURCE / "tools/flash/bushd-flash").read_text())
        avrdude = self.prefix / "bin/avrdude"
        avrdude.write_text(f'#!/bin/sh\necho "$@" >> {self.prefix}/called\n'
                           f'for word; do case $word in eeprom:*) file=${{word#eeprom:w:}}; cp "${{file%:r}}" {self.prefix}/eeprom ;; esac; done\n')
        for program in (self.program, avrdude):
            program.chmod(program.stat().st_mode | stat.S_IXUSR)
        self.firmware = self.prefix / "share/bushd/firmware"
        self.firmware.mkdir(parents=True)
        (self.firmware / "bushd-atmega2560-500000.hex").write_text("")
        self.versions(4, 4)

    def versions(self, image, daemon):
        (self.firmware / "protocol-version").write_text(f"{image}\n")
        (self.prefix / "share/bushd/protocol-version").write_text(f"{daemon}\n")

    def flash(self, *arguments):
        path = f"{self.prefix}/bin:{os.environ['PATH']}"
        return subprocess.run([self.program, *arguments], capture_output=True, text=True, env={**os.environ, "PATH": path}, check=False)

    def test_gives_a_new_chip_fuses_program_and_address(self):
        ran = self.flash("atmega2560", "500000", "--fuses", "--address", "3")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        fuses, program, memory = (self.prefix / "called").read_text().splitlines()
        self.assertEqual(fuses, "-p m2560 -c usbasp -U lfuse:w:0xFF:m -U hfuse:w:0xD1:m -U efuse:w:0xFC:m")
        self.assertRegex(program, r"^-p m2560 -c usbasp -U flash:w:\S+/bushd-atmega2560-500000\.hex:i$")
        self.assertRegex(memory, r"-U eeprom:w:\S+:r$")
        kept = (self.prefix / "eeprom").read_bytes()
        self.assertEqual((kept[8], int.from_bytes(kept[9:], "little")), (3, zlib.crc32(kept[:9])))

    def test_the_fuses_are_those_of_the_documentation(self):
        documented = re.findall(r"[lhe]fuse:w:0x..:m", re.search("avrdude -p m2560 .*", (SOURCE / "docs/firmware.md").read_text())[0])
        self.flash("atmega2560", "500000", "--fuses")
        self.assertEqual(re.findall(r"[lhe]fuse:w:0x..:m", (self.prefix / "called").read_text()), documented)

    def test_refuses_another_protocol_unless_forced(self):
        self.versions(3, 4)
        ran = self.flash("atmega2560", "500000")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("images speak protocol 3, the bushd of this PC protocol 4", ran.stderr)
        self.assertFalse((self.prefix / "called").exists())
        self.assertEqual(self.flash("--check").returncode, 1)
        self.assertEqual(self.flash("atmega2560", "500000", "--force").returncode, 0)

    def test_names_the_baud_rates_that_there_are(self):
        ran = self.flash("atmega2560", "115200")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("there are 500000", ran.stderr)

    def test_flashes_the_image_for_another_keypad(self):
        (self.firmware / "bushd-atmega2560-switch-500000.hex").write_text("")
        self.assertEqual(self.flash("atmega2560", "500000", "--keypad-switch").returncode, 0)
        self.assertIn("/bushd-atmega2560-switch-500000.hex:i", (self.prefix / "called").read_text())
        ran = self.flash("atmega2560", "1000000", "--keypad-switch")
        self.assertIn("there is no image of atmega2560 for a keypad with a direction switch and 1000000 baud; there are 500000\n", ran.stderr)
        # The others are no baud rates of it.
        self.assertIn("there are 500000\n", self.flash("atmega2560", "250000").stderr)

    def test_runs_nothing_when_asked_for_the_commands_only(self):
        ran = self.flash("atmega2560", "500000", "--dry-run")
        self.assertIn("avrdude -p m2560", ran.stdout)
        self.assertFalse((self.prefix / "called").exists())

    def test_page_and_help_tell_of_the_same_options(self):
        page = (SOURCE / "docs/man/bushd-flash.1").read_text().replace(r"\-", "-")
        options = set(re.findall(r"^\.TP\n\\fB(--[a-z-]+)", page, re.MULTILINE))
        said = set(re.findall(r"^  (--[a-z-]+)", self.flash("--help").stdout, re.MULTILINE))
        self.assertEqual(options, said)


if __name__ == "__main__":
    unittest.main()
