#!/usr/bin/env python3
"""docs/rooms.toml against the tree: every include of every room goes to a room that it uses, and design.md shows the same."""

import pathlib
import unittest

import rooms as told
from rooms import SOURCE, Rooms, includes, sources

ROOMS = Rooms((SOURCE / "docs/rooms.toml").read_text(encoding="utf-8"))


def included(path, header, known):
    """Which file of the tree an include in quotes means; None: one that the build makes."""
    places = (path.parent / header, pathlib.Path("lib") / header, pathlib.Path(header), pathlib.Path("tools") / header)
    return next((place for place in map(normal, places) if place in known), None)


def normal(path):
    parts = []
    for part in path.parts:
        if part == "..":
            parts.pop()
        else:
            parts.append(part)
    return pathlib.Path(*parts)


class RoomsOfTheTree(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.files = list(sources())
        cls.known = set(cls.files)

    def test_every_source_is_in_a_room(self):
        self.assertGreater(len(self.files), 500)
        self.assertEqual([str(path) for path in self.files if ROOMS.room_of(path) is None], [])

    def test_rooms_use_only_rooms_that_stand_before_them(self):
        before = set()
        for path, room in ROOMS.rooms.items():
            with self.subTest(path):
                self.assertTrue((SOURCE / path).is_dir())
                self.assertEqual([used for used in room["uses"] if used not in before], [])
            before.add(path)

    def test_includes_go_to_rooms_that_may_be_used_and_no_room_may_use_more(self):
        used = {path: set() for path in ROOMS.rooms}
        faults = []
        for path in self.files:
            room = ROOMS.room_of(path)
            for number, header, is_quoted in includes(SOURCE / path):
                target = included(path, header, self.known) if is_quoted else None
                there = target and ROOMS.room_of(target)
                if there is None or there == room:
                    continue
                used[room].add(there)
                if there not in ROOMS.rooms[room]["uses"]:
                    faults.append(f'{path}:{number}: "{header}" is in {there}, which {room} does not use (docs/rooms.toml)')
        self.assertEqual(faults, [])
        for path, room in ROOMS.rooms.items():
            self.assertEqual(set(room["uses"]) - used[path], set(), f"{path} uses these nowhere: docs/rooms.toml")

    def test_libraries_are_included_where_it_says(self):
        used = {path: set() for path in ROOMS.rooms}
        faults = []
        for path in self.files:
            room = ROOMS.room_of(path)
            for number, header, is_quoted in includes(SOURCE / path):
                library = None if is_quoted else ROOMS.library(header)
                if library is None:
                    continue
                used[room].add(library)
                if library not in ROOMS.rooms[room].get("libraries", []):
                    faults.append(f"{path}:{number}: <{header}>: {room} does not use {library} (docs/rooms.toml)")
        self.assertEqual(faults, [])
        for path, room in ROOMS.rooms.items():
            self.assertEqual(set(room.get("libraries", [])) - used[path], set(), f"{path} includes these nowhere: docs/rooms.toml")

    def test_design_shows_them(self):
        page = (SOURCE / "docs/design.md").read_text(encoding="utf-8")
        self.assertTrue(told.shown(ROOMS) in page, "run tests/documents/rooms.py --write")


if __name__ == "__main__":
    unittest.main()
