"""Speed envelopes as the Python client reads them, and the path that each makes of a motor."""

import dataclasses
import pathlib
import tempfile
import unittest

import bushd
from bushd import model

TEXT = 'table = "feed"\nzones = [[0, 100], [10, 250]]\nend = 30\n'


def motor(**changed):
    fields = {field.name: None for field in dataclasses.fields(model.Motor)}
    fields |= {
        "name": "feed",
        "position": 1000.0,
        "moving": False,
        "negative": False,
        "offset": 0.0,
        "steps_per_unit": "1",
        "table": model.TableRef("feed", 1, "00000000"),
    }
    return model.Motor(**(fields | changed))


def blade(**changed):
    """400 steps a mm, backwards, at 47.5 mm where the counter is 1000."""
    return motor(**({"position": 47.5, "negative": True, "offset": 50.0, "steps_per_unit": "400"} | changed))


class Envelopes(unittest.TestCase):
    def load(self, text):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "in.envelope"
            file.write_text(text)
            return bushd.Envelope.load(file)

    def test_by_distance_begins_where_the_motor_stands(self):
        self.assertEqual(self.load(TEXT).path(motor()), ([(1010.0,), (1030.0,)], [100.0, 250.0]))

    def test_by_position_has_a_way_to_its_first_zone(self):
        text = 'table = "feed"\nby = "position"\nzones = [[500, 100], [400, 250]]\nend = -30\n'
        self.assertEqual(self.load(text).path(motor(position=None)), ([(500.0,), (400.0,), (-30.0,)], [0.0, 100.0, 250.0]))

    def test_a_motor_with_a_unit(self):
        text = 'table = "feed"\nsteps_per_unit = 400\nzones = [[0, 0.5], [1, 1.25]]\nend = 2\n'
        self.assertEqual(self.load(text).path(blade()), ([(48.5,), (49.5,)], [0.5, 1.25]))
        steps = 'table = "feed"\nzones = [[0, 100], [400, 500]]\nend = 800\n'
        self.assertEqual(self.load(steps).path(blade()), ([(46.5,), (45.5,)], [0.25, 1.25]))
        at = 'table = "feed"\nby = "position"\nzones = [[400, 100]]\nend = 800\n'
        self.assertEqual(self.load(at).path(blade())[0], [(49.0,), (48.0,)])

    def test_what_does_not_fit_is_refused(self):
        for of, why in [
            (motor(table=model.TableRef("other", 1, "")), "for the table feed, and feed goes by other"),
            (motor(moving=True), "at rest"),
            (motor(position=None), "that is known"),
        ]:
            with self.assertRaisesRegex(ValueError, why):
                self.load(TEXT).path(of)
        with self.assertRaisesRegex(ValueError, "100.0 steps per unit, and feed has 400"):
            self.load(TEXT + "steps_per_unit = 100\n").path(blade())

    def test_what_is_wrong_is_refused_with_the_file(self):
        for text, why in [
            ("zones = 3", "table: is missing"),
            (TEXT + "speed = 3\n", "speed: unknown key"),
            (TEXT.replace('"feed"', '""'), "table: allowed"),
            (TEXT.replace("[0, 100]", "[0]"), "zones: allowed: pairs"),
            (TEXT.replace("[0, 100]", "[5, 100]"), "begins at 5.0; allowed by distance: 0"),
            (TEXT.replace("[10, 250]", "[30, 250]"), "further on in one direction"),
            (TEXT.replace("[10, 250]", "[-1, 250]"), "further on in one direction"),
            (TEXT.replace("250", "0"), "speeds above 0"),
            (TEXT.replace("250", "nan"), "finite"),
            (TEXT.replace("250", "true"), "zones: is True; allowed: a number"),
            (TEXT.replace("30", "0"), "further on"),
            ('table = "feed"\nzones = []\nend = 3\n', "0 zones"),
            (TEXT + 'by = "time"\n', "by: is 'time'"),
            (TEXT + "steps_per_unit = 0\n", "allowed: a number above 0"),
            ("table = ", "in.envelope: "),
        ]:
            with self.subTest(text), self.assertRaisesRegex(ValueError, why) as refused:
                self.load(text)
            self.assertIn("in.envelope: ", str(refused.exception))


if __name__ == "__main__":
    unittest.main()
