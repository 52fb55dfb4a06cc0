#!/usr/bin/env python3
"""Each field has the name of the member that it tells. (Two members of one type that had each other's names would pass all other tests.)

Where the names differ for good, TOLD says which member it is. $BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
HEADERS = sorted([*(SOURCE / "lib/api").glob("*.h"), *(SOURCE / "lib/lcm").glob("*.h"), SOURCE / "lib/words/camac.h"])

# Name of the field: member. What one word would mean for many types has a longer one in messages.
TOLD = {
    "asked_by": "who",
    "boot_number": "boot",
    "cruise": "cruise_told",
    "decel": "decel_codes",
    "description": "text",
    "dial_high": "dial.high",
    "dial_low": "dial.low",
    "dial_position": "dial",
    "feed": "per_s",
    "feed_in_steps": "in_steps",
    "line_fraction": "line_now.fraction",
    "line_left_s": "line_now.left_us",
    "speed": "per_s",
    "speed_in_steps": "in_steps",
    "user_high": "user.high",
    "user_low": "user.low",
    "user_position": "user",
    "value_in_file": "in_file",
}


def without_comments(text):
    return re.sub(r"//[^\n]*", "", text)


def texts_joined(text):
    """Adjacent literals as one, so that none of them has a comma or a parenthesis."""
    return re.sub(r'"(?:[^"\\]|\\.)*"', lambda found: '"' + re.sub(r"\W", "_", found[0][1:-1]) + '"', text)


def constants(texts):
    """Names of fields that are constants: kDelay{"delay_us", ...}."""
    return {name: field for text in texts for name, field in re.findall(r"\bfields::Field (k\w+)\{\s*\"(\w+)\"", text)}


def visits(text):
    """First argument, and member, of each visit(...) and visit.list(...)."""
    for found in re.finditer(r"\bvisit(\.list)?\(", text):
        arguments, depth, begin = [], 0, found.end()
        for at in range(begin, len(text)):
            if text[at] in "({[":
                depth += 1
            elif text[at] in ")}]":
                if depth == 0:
                    arguments.append(text[begin:at])
                    break
                depth -= 1
            elif text[at] == "," and depth == 0:
                arguments.append(text[begin:at])
                begin = at + 1
        if found[1]:
            arguments = arguments[1:]  # the count
        yield arguments[0].strip(), arguments[1].strip()


def name_of(field, known):
    if literal := re.match(r"\{?\s*\"(\w+)\"", field):
        return literal[1]
    return known.get(field.split("::")[-1], field)


class FieldNames(unittest.TestCase):
    def test_fields_are_called_as_their_members(self):
        texts = {path: texts_joined(without_comments(path.read_text())) for path in HEADERS}
        known = constants(texts.values())
        seen = set()
        for path, text in texts.items():
            for field, member in visits(text):
                name = name_of(field, known)
                if name == "names":  # of those that name motors
                    continue
                seen.add(name)
                told = re.sub(r"^(self\.block|self|told|content|traffic)\.", "", member)
                with self.subTest(header=path.name, field=name):
                    self.assertIn(told, (name, TOLD.get(name)))
        self.assertGreater(len(seen), 120)
        self.assertEqual(set(TOLD) - seen, set(), "no field has these names")


if __name__ == "__main__":
    unittest.main()
