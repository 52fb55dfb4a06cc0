#!/usr/bin/env python3
"""names.toml, who may put, scales, and how fast a motor goes by its table."""

import pathlib
import sys
import tempfile
import unittest

from bushd import model
from bushd_epics import beside, compare, motor, names, trigger
from bushd_epics.access import Access
from bushd_epics.scale import Scale, resolution


class Names(unittest.TestCase):
    def test_what_is_not_named_keeps_its_name(self):
        self.assertEqual([names.NONE.of(name) for name in ("theta", "slit gap", "a.b", "b-1:2")], ["theta", "slit_gap", "a_b", "b-1:2"])

    def test_names_and_hosts(self):
        read = names.parse({"names": {"theta": "m1", "spare": ""}, "allow": {"hosts": ["10.0.0.0/8"]}})
        self.assertEqual((read.of("theta"), read.of("spare"), read.of("phi"), read.hosts), ("m1", "", "phi", ("10.0.0.0/8",)))
        self.assertEqual(names.parse({}).hosts, ("127.0.0.1",))

    def test_profiles_list_motors_as_bushd_has_them(self):
        read = names.parse({"names": {"theta": "m1"}, "profiles": {"pm1": ["theta", "phi"], "pm2": ["chi"]}})
        self.assertEqual(read.profiles, {"pm1": ("theta", "phi"), "pm2": ("chi",)})
        self.assertEqual(names.NONE.profiles, {})

    def test_a_fault_names_its_key(self):
        for content, key in (
            ({"name": {}}, "name: unknown key"),
            ({"allow": {"host": []}}, "allow.host: unknown key"),
            ({"names": {"theta": "m 1"}}, "names.theta"),
            ({"names": {"theta": 3}}, "names.theta"),
            ({"names": {"a": "m", "b": "m"}}, "m is the name of two motors"),
            ({"allow": {"hosts": "all"}}, "allow.hosts"),
            ({"allow": {"hosts": [""]}}, "allow.hosts"),
            ({"names": []}, "tables"),
            ({"profiles": []}, "profiles is a table"),
            ({"profiles": {"p 1": ["theta"]}}, "profiles.p 1"),
            ({"profiles": {"pm1": "theta"}}, "profiles.pm1"),
            ({"profiles": {"pm1": []}}, "profiles.pm1"),
            ({"profiles": {"pm1": ["theta", "theta"]}}, "each once"),
            ({"profiles": {"pm1": [str(number) for number in range(17)]}}, "1 to 16 motors"),
        ):
            with self.subTest(content=content), self.assertRaisesRegex(names.BadNames, key):
                names.parse(content)

    def test_a_file_that_is_no_toml_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            for content in (b"[names", b"\xff\xfe"):
                file = pathlib.Path(folder, "names.toml")
                file.write_bytes(content)
                with self.assertRaisesRegex(names.BadNames, "names.toml"):
                    names.read(str(file))


class Beside(unittest.TestCase):
    """Variables of position compare and trigger."""

    def test_a_motor_may_have_in_its_name_what_a_field_begins_with(self):
        for name in ("m", "mPCO1", "mPCO", "PCO", "m_trg", "m_trg1", "m_trgPCO1", "mPCO1_trg", "pm1:m"):
            for field in (*compare.FIELDS, *trigger.FIELDS):
                with self.subTest(name=name, field=field):
                    self.assertEqual(beside.split(name + field), (name, field))

    def test_other_names_have_no_such_field(self):
        for name in ("m", "mPCO1", "m_trg", "mPCO", "m_able", "mPCOEnable1", "mPCOenable", "m_trgArm ", "_trg", ""):
            with self.subTest(name=name), self.assertRaises(KeyError):
                beside.split(name)


class Rights(unittest.TestCase):
    def test_hosts_are_addresses_and_networks(self):
        access = Access(["127.0.0.1", "10.0.5.0/24", "::1"])
        allowed = ("127.0.0.1", "10.0.5.7", "::1")
        self.assertTrue(all(map(access.may_put, allowed)))
        self.assertFalse(any(map(access.may_put, ("127.0.0.2", "10.0.6.7", "::2", "localhost", "", "127.0.0.1 "))))

    def test_read_only_is_for_all(self):
        self.assertFalse(Access(["127.0.0.1"], read_only=True).may_put("127.0.0.1"))


class Scales(unittest.TestCase):
    def test_steps_of_a_unit(self):
        self.assertEqual([resolution(text) for text in ("100", "1/3", "12.5", "")], [0.01, 3.0, 0.08, 1.0])

    def test_there_and_back(self):
        for scale in (Scale(0.01), Scale(0.01, True, 12.5)):
            for user in (-3.25, 0.0, 12.5, 100.0):
                self.assertEqual(scale.user(scale.dial(user)), user)


class Speeds(unittest.TestCase):
    TABLE = model.Table(name="t", time_unit_ns=1000, accel=(4000, 2000, 1000, 500))
    ENTRY = model.TableEntry(name="t", table=model.TableRef("t", 1, ""), fault="", codes=4, start_steps_per_s=250.0, max_steps_per_s=2000.0)

    def of(self, max_speed=None, share=1.0):
        found = motor.speeds(self.TABLE, self.ENTRY, 0.01, max_speed, share)
        return found.top, found.least, found.ramp_s

    def test_the_ramp_is_all_delays_above_the_shortest(self):
        for found, wanted in (
            (self.of(), (20.0, 2.5, 0.007)),
            (self.of(share=0.5), (20.0, 2.5, 0.014)),
            (self.of(max_speed=5.0), (5.0, 2.5, 0.004)),
            (self.of(max_speed=1.0), (1.0, 1.0, 0.0)),
        ):
            for one, other in zip(found, wanted, strict=True):
                self.assertAlmostEqual(one, other, places=12)


class Package(unittest.TestCase):
    def test_rules_need_no_caproto(self):
        from bushd_epics import names as _, record as __  # noqa: F401

        self.assertNotIn("caproto", sys.modules)


class Lookups(unittest.TestCase):
    def test_a_name_that_was_not_found_may_put_once_it_is(self):
        known = {}

        def look_up(name):
            if name not in known:
                raise OSError("Name or service not known")
            return known[name]

        with self.assertLogs("bushd-epics", "WARNING") as log:
            access = Access(["console1", "10.0.0.1"], look_up=look_up)
        self.assertIn("write its address", log.output[0])
        self.assertEqual((access.unknown, access.may_put("10.0.0.7"), access.may_put("10.0.0.1")), (["console1"], False, True))
        with self.assertNoLogs("bushd-epics"):
            self.assertFalse(access.look_up())
        known["console1"] = ["10.0.0.7"]
        self.assertTrue(access.look_up())
        self.assertEqual((access.unknown, access.may_put("10.0.0.7")), ([], True))


if __name__ == "__main__":
    unittest.main()
