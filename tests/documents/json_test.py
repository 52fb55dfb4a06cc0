#!/usr/bin/env python3
"""JSON becomes text in lib/base/json_text.h alone: anywhere else dump() would end a program at the first text that is no UTF-8.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
HELPER = SOURCE / "lib/base/json_text.h"


class Json(unittest.TestCase):
    def test_nobody_else_calls_dump(self):
        for folder in ("daemon", "lib", "tools"):
            for page in [*(SOURCE / folder).rglob("*.cpp"), *(SOURCE / folder).rglob("*.h")]:
                with self.subTest(file=str(page.relative_to(SOURCE))):
                    found = re.search(r"\.dump\(|<< *\w*json", page.read_text())
                    self.assertTrue(page == HELPER or found is None or "json.hpp" not in page.read_text(), found)


if __name__ == "__main__":
    unittest.main()
