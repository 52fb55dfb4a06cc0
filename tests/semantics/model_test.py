#!/usr/bin/env python3
"""The arithmetic of the model, by examples worked out by hand."""
import unittest
from fractions import Fraction

from model import Amount, Motor, Refused, nearest


class Arithmetic(unittest.TestCase):
    def test_ties_go_away_from_zero(self):
        self.assertEqual([nearest(Fraction(n, 2)) for n in (-3, -1, 0, 1, 3, 5)], [-2, -1, 0, 1, 2, 3])
        self.assertEqual(nearest(Fraction("0.4999999999999999999")), 0)

    def test_blade(self):
        blade = Motor("m", unit=True, steps_per_unit=Fraction(400), negative=True, offset=Fraction(10),
                      limits=(Fraction(-5), Fraction("5.5")))
        self.assertEqual(blade.steps_of_position(Amount(user="8.0014")), {799})
        self.assertEqual(blade.user(799), Fraction("8.0025"))
        self.assertEqual(blade.steps_of_distance(Amount(user="1")), -400)
        self.assertEqual(blade.step_limits(), (-2000, 2200))
        self.assertTrue(blade.may_aim(2200, 0, 0))
        self.assertFalse(blade.may_aim(2201, 0, 0))
        self.assertTrue(blade.may_aim(2300, 2400, 2400))
        self.assertIsNone(blade.may_aim(2300, 2400, 2200))

    def test_limits_are_not_rounded_outwards(self):
        motor = Motor("m", unit=True, steps_per_unit=Fraction(1000, 3), limits=(Fraction("-0.01"), Fraction("0.01")))
        self.assertEqual(motor.step_limits(), (-3, 3))

    def test_set_user_is_of_where_it_stands(self):
        motor = Motor("m", unit=True, steps_per_unit=Fraction(1000, 3), steps=100)
        motor.set_user("7")
        self.assertEqual(motor.offset, Fraction("6.7"))
        self.assertTrue(motor.exact_offset)
        motor.steps = 101
        motor.set_user("7")
        self.assertEqual(motor.offset, Fraction("6.697"))
        third = Motor("m", unit=True, steps_per_unit=Fraction(3), steps=1)
        third.set_user("1")
        self.assertFalse(third.exact_offset)

    def test_speeds(self):
        motor = Motor("m", unit=True, steps_per_unit=Fraction(400), time_unit_ns=40000)
        self.assertEqual(motor.shortest_delay(Fraction(1), False), 63)  # 62.5, never faster
        self.assertEqual(motor.shortest_delay(Fraction(400), True), 63)
        self.assertEqual(motor.shortest_delay(Fraction("0.0000625"), False), 10**6)  # 40 s a step
        with self.assertRaises(Refused):
            motor.shortest_delay(Fraction("0.0000006"), False)

    def test_legs(self):
        motor = Motor("m", unit=True, steps_per_unit=Fraction(400), time_unit_ns=40000, backlash=Fraction("0.1"))
        self.assertEqual(motor.legs(0, -600, 0), [(-640, 0), (-600, 0)])
        self.assertEqual(motor.legs(0, 600, 0), [(600, 0)])
        self.assertEqual(motor.legs(None, 600, 0), [(560, 0), (600, 0)])
        self.assertEqual(motor.legs(600, 600, 0), [(600, 0)])
        motor.backlash_speed = Fraction("0.5")
        self.assertEqual(motor.legs(0, 600, 0), [(560, 0), (600, 125)])
        self.assertEqual(motor.legs(0, 40, 0), [(40, 125)])
        self.assertEqual(motor.legs(0, 600, 125), [(600, 125)])
        motor.negative = True
        self.assertEqual(motor.legs(0, -600, 0), [(-560, 0), (-600, 125)])

    def test_jogs(self):
        motor = Motor("m", unit=True, steps_per_unit=Fraction(400), negative=True, limits=(Fraction(-1), Fraction(1)),
                      time_unit_ns=40000)
        self.assertEqual(motor.jog(Fraction(1), False), -1)
        self.assertEqual(motor.jog(Fraction(1), True), 1)
        self.assertEqual(motor.farthest(-1), -400)
        motor.steps = 400
        with self.assertRaises(Refused):
            motor.jog(Fraction(1), True)
        motor.held = True
        with self.assertRaisesRegex(Refused, "held"):
            motor.jog(Fraction(-1), True)
        motor.daemon_restarted(True)
        self.assertTrue(motor.held)
        motor.daemon_restarted(False)
        self.assertFalse(motor.held)

    def test_settings(self):
        motor = Motor("m", unit=True, steps_per_unit=Fraction(400), steps=800)
        motor.is_as_written()
        motor.configure("offset", "1.5")
        motor.configure("direction", True)
        motor.configure("soft_limits", ("-1", "1"))
        self.assertEqual(motor.user(800), Fraction("-0.5"))
        self.assertTrue(motor.is_outside())
        motor.daemon_restarted(False)
        self.assertEqual(motor.user(800), 2)
        self.assertFalse(motor.is_outside())


if __name__ == "__main__":
    unittest.main()
