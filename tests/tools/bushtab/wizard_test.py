#!/usr/bin/env python3
"""bushtab wizard on a terminal: a wrong answer is asked for again. The program is $BUSHTAB."""

import os
import pathlib
import pty
import subprocess
import tempfile
import unittest


class Wizard(unittest.TestCase):
    def test_wrong_answers_are_asked_for_again(self):
        with tempfile.TemporaryDirectory() as folder:
            table = pathlib.Path(folder, "feed.toml")
            main, terminal = pty.openpty()
            wizard = subprocess.Popen(
                [os.environ["BUSHTAB"], "wizard", table], stdin=terminal, stdout=terminal, stderr=terminal, close_fds=True
            )
            os.close(terminal)
            said = b""
            for answer in "fast", "4kHz", "5kHz", "200Hz", "300ms", "", "", "maybe", "yes":
                # Its question stands there before it is answered.
                while not said.endswith(b": "):
                    said += os.read(main, 4096)
                os.write(main, answer.encode() + b"\n")
                said += b"\n"
            try:
                while more := os.read(main, 4096):
                    said += more
            except OSError:  # its end of the terminal is closed
                pass
            os.close(main)
            text = said.decode()
            self.assertEqual(wizard.wait(60), 0, text)
            self.assertEqual(text.count("MAX_SPEED"), 2, text)
            self.assertEqual(text.count("SS_SPEED"), 2, text)
            self.assertIn("at most the maximum speed, 4000 steps/s", text)
            self.assertIn("allowed: yes, no, or again", text)
            self.assertIn("revision 1", text)
            self.assertTrue(table.exists())


if __name__ == "__main__":
    unittest.main()
