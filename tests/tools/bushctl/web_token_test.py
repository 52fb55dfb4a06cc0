#!/usr/bin/env python3
"""bushctl web-token, and what it leaves in the file of tokens. $BUSHCTL is the program."""

import hashlib
import json
import os
import pathlib
import pwd
import re
import stat
import subprocess
import tempfile
import unittest

BUSHCTL = os.environ["BUSHCTL"]
DAY_S = 24 * 3600
NOBODY = 65534


class WebToken(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.file = self.folder / "tokens"

    def run_it(self, *arguments, **more):
        environment = {**os.environ, "BUSHD_WEB_TOKENS": str(self.file), "TZ": "UTC"}
        return subprocess.run([BUSHCTL, "web-token", *arguments], capture_output=True, text=True, check=False, env=environment, **more)

    def done(self, *arguments, **more):
        ran = self.run_it(*arguments, **more)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        return ran.stdout

    def refused(self, *arguments, code=1, **more):
        ran = self.run_it(*arguments, **more)
        self.assertEqual((ran.returncode, ran.stdout, len(ran.stderr.splitlines())), (code, "", 1), ran.stderr)
        return ran.stderr

    def kept(self):
        return [line.split() for line in self.file.read_text().splitlines() if not line.startswith("#")]

    def test_shows_a_token_once_and_keeps_its_hash(self):
        shown = self.done()
        (token,) = re.findall(r"^ {4}((?:[0-9a-z]{4}-){7}[0-9a-z]{4})$", shown, re.MULTILINE)
        plain = token.replace("-", "")
        ((digest, name, expires, made, by),) = self.kept()
        self.assertEqual(digest, hashlib.sha256(plain.encode()).hexdigest())
        user = pwd.getpwuid(os.getuid()).pw_name
        self.assertEqual((name, by), (user, user))
        self.assertEqual(int(expires) - int(made), 90 * DAY_S)
        self.assertNotIn(plain[:4], self.file.read_text().replace(digest, ""))
        self.assertIn(f"'bushctl web-token --revoke {user}' takes it back", shown)
        self.assertEqual(stat.S_IMODE(self.file.stat().st_mode), 0o660)

    def test_each_is_another_one(self):
        tokens = {json.loads(self.done(f"t{number}", "--json"))["token"] for number in range(8)}
        self.assertEqual(len(tokens), 8)
        self.assertEqual(len(self.kept()), 8)

    def test_as_json(self):
        made = json.loads(self.done("tablet", "--days", "7", "--json"))
        self.assertEqual(list(made), ["name", "token", "expires_s", "file"])
        ((digest, _, expires, at, by),) = self.kept()
        self.assertEqual((made["name"], made["expires_s"], made["file"]), ("tablet", int(expires), str(self.file)))
        self.assertEqual(hashlib.sha256(made["token"].replace("-", "").encode()).hexdigest(), digest)
        listed = json.loads(self.done("--list", "--json"))
        self.assertEqual(listed, {"file": str(self.file), "tokens": [
            {"name": "tablet", "expires_s": int(expires), "expired": False, "made_s": int(at), "made_by": by}]})
        self.assertEqual(json.loads(self.done("--revoke", "tablet", "--json")), {"revoked": "tablet", "file": str(self.file)})
        self.assertEqual(json.loads(self.done("--list", "--json"))["tokens"], [])

    def test_lists_also_those_that_have_expired(self):
        self.assertIn("'bushctl web-token' makes one", self.done("--list"))
        self.done("tablet", "--days", "3650")
        with self.file.open("a") as file:
            file.write(f"{'a' * 64} old 86400 0 otto\n")
        header, *lines = self.done("--list").splitlines()
        self.assertEqual(header.split(), ["NAME", "EXPIRES", "MADE", "BY"])
        self.assertRegex(lines[0], r"^tablet  20\d\d-\d\d-\d\d \d\d:\d\d  valid    20")
        self.assertRegex(lines[1], r"^old     1970-01-02 00:00  expired  1970-01-01 00:00  otto$")
        self.done("old")
        self.assertNotIn("expired", self.done("--list"))

    def test_a_name_is_there_once(self):
        self.done("tablet")
        before = self.file.read_text()
        self.assertIn("remove that one with 'bushctl web-token --revoke tablet'", self.refused("tablet"))
        self.assertEqual(self.file.read_text(), before)
        self.assertIn('"tablet" is revoked', self.done("--revoke", "tablet"))
        self.assertIn("'bushctl web-token --list' lists them", self.refused("--revoke", "tablet"))
        self.done("tablet")

    def test_the_file_of_an_option_comes_before_that_of_the_environment(self):
        self.done("tablet", "--file", str(self.folder / "other"))
        self.assertFalse(self.file.exists())
        self.assertIn("tablet", (self.folder / "other").read_text())

    def test_wrong_usage(self):
        self.assertIn("is no name of a token", self.refused("a b", code=2))
        self.assertIn("is no name of a token", self.refused("\N{LATIN SMALL LETTER A WITH DIAERESIS}", code=2))
        self.assertIn("one of NAME, --list and --revoke", self.refused("tablet", "--list", code=2))
        self.assertIn("one of NAME, --list and --revoke", self.refused("--list", "--revoke", "tablet", code=2))
        for wrong in (("--days", "0"), ("--days", "3651"), ("--days", "x"), ("a", "b"), ("--revoke",)):
            with self.subTest(wrong):
                self.assertEqual(self.run_it(*wrong).returncode, 2)
        self.assertFalse(self.file.exists())

    def test_without_a_right_it_is_one_sentence_with_the_remedy(self):
        self.done("tablet")
        self.folder.chmod(0o2700 if os.getuid() == 0 else 0)
        self.addCleanup(self.folder.chmod, 0o700)
        as_user = {"user": NOBODY, "group": NOBODY, "extra_groups": []} if os.getuid() == 0 else {}
        for arguments in ((), ("--list",), ("--revoke", "tablet")):
            with self.subTest(arguments):
                self.assertIn("it is for the group bushd. Run 'sudo usermod -aG bushd USER', then log in again",
                              self.refused(*arguments, **as_user))

    def test_without_the_folder_it_names_the_package(self):
        self.file = self.folder / "none/tokens"
        for arguments in ((), ("--list",)):
            self.assertIn("the package bushd-web makes it", self.refused(*arguments))

    def test_a_file_that_is_none_is_left_alone(self):
        self.file.write_text("something else\n")
        self.assertIn("tokens:1: has 2 fields; a token has 5", self.refused("tablet"))
        self.assertEqual(self.file.read_text(), "something else\n")


if __name__ == "__main__":
    unittest.main()
