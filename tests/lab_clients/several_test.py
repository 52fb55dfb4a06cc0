#!/usr/bin/env python3
"""One bridge for two daemons; and what a lab has beside plain motors: pseudo-axes, homing, drivers, screens."""

import os
import pathlib
import signal
import subprocess
import sys
import unittest
import xml.etree.ElementTree as ET

from lab import PLACES, LabTest, configuration
from rig import Trace, program

SLIT = '[[pseudo]]\nname = ["gap", "centre"]\nunit = "deg"\nmotors = ["theta", "phi"]\nkind = "slit"\nsoft_limits = [[-100, 100], [-50, 50]]'
HOME = 'home = { direction = "negative", position_steps = -50, most_steps = 5000 }'
HOME_SWITCH = ("--switch", "1.0@-300")


class TwoDaemons(LabTest):
    def setUp(self):
        self.daemons, self.sims = {}, {}

    def use(self, name):
        """Commands of bushctl go to this daemon from now on; what is started is in its folder."""
        os.environ["BUSHD_CONTROL"] = str(self.file(name) / "control")
        os.environ["RUNTIME_DIRECTORY"] = str(self.file(name))

    def bring_up(self, name):
        self.file(name).mkdir()
        config = self.file(name) / "bushd.toml"
        config.write_text(configuration(self.file(name)))
        self.use(name)
        command = [program("BUSHSIM"), "--config", config, "--link", self.file(name) / "port", "--trace", self.file(name) / "trace.vcd"]
        sim = self.start(command, f"bushsim-{name}.log", True)
        self.wait_until("bushsim to offer its port", lambda: "bushsim: ready" in sim.said())
        self.sims[name] = sim
        self.start_daemon(name)
        for motor in PLACES:
            self.command("set", motor, "--dial", "0")

    def start_daemon(self, name):
        self.use(name)
        self.daemons[name] = self.start([program("BUSHD"), "--config", self.file(name) / "bushd.toml"], f"bushd-{name}-{len(self.programs)}.log", True)
        self.wait_until_ready()

    def start_bridge(self, *options):
        command = [sys.executable, "-B", "-m", "bushd_epics", "--prefix", "LAB:", *options]
        for name in ("hall", "lab2"):
            command += ["--daemon", f"{name}={self.file(name) / 'control'}"]
        bridge = self.start(command, f"bushd-epics-{len(self.programs)}.log")
        self.wait_until("bushd-epics to be ready", lambda: "ready" in bridge.said() or not bridge.lives())
        self.assertTrue(bridge.lives(), bridge.said())
        return bridge

    def end_both(self):
        """Steps of theta by daemon, as the traces have them."""
        self.assertEqual(self.bridge.end(), 0)
        for running in [*self.daemons.values(), *self.sims.values()]:
            self.assertEqual(running.end(), 0)
        edges = {name: Trace(self.file(name) / "trace.vcd").edges.get(PLACES["theta"], []) for name in self.sims}
        return {name: sum(1 if edge.direction else -1 for edge in of) for name, of in edges.items()}

    def test_motors_of_the_same_name_are_those_of_their_daemon(self):
        self.bring_up("hall")
        self.bring_up("lab2")
        self.bridge = self.start_bridge()
        self.put("hall:theta.VAL", 2.0)
        self.put("lab2:theta.VAL", -3.0)
        self.assertEqual([self.get(f"{name}:theta.RBV") for name in ("hall", "lab2")], [2.0, -3.0])
        self.assertEqual(self.end_both(), {"hall": 200, "lab2": -300})

    def test_the_death_of_one_leaves_the_other_as_it_is(self):
        self.bring_up("hall")
        self.bring_up("lab2")
        self.bridge = self.start_bridge()
        heard = self.watch("hall:theta.SEVR", "lab2:theta.SEVR", "lab2:theta.DMOV")
        self.put("lab2:theta.VAL", 400.0, wait=False)
        self.wait_for("lab2:theta.MOVN", lambda movn: movn == 1)
        heard.clear()
        self.daemons["hall"].send(signal.SIGKILL)
        self.daemons["hall"].process.wait()
        self.wait_for("hall:theta.SEVR", lambda severity: severity == 3)
        self.assertEqual([self.get(f"lab2:theta.{field}") for field in ("SEVR", "DMOV")], [0, 0])
        self.assertTrue(self.put_fails("hall:theta.VAL", 1.0))
        # What is there is stopped, and who has asked hears that not all was.
        self.assertTrue(self.put_fails("allstop", 1))
        self.wait_for("lab2:theta.DMOV", lambda dmov: dmov == 1)
        stands = self.get("lab2:theta.RBV")
        self.assertLess(stands, 399.0)
        self.put("lab2:theta.VAL", 1.0)
        self.assertEqual(self.get("lab2:theta.RBV"), 1.0)
        self.assertNotIn(3, [severity for name, value, severity in heard.take() if name == "DMOV"])
        self.start_daemon("hall")
        self.wait_until("a move of it to succeed", lambda: not self.put_fails("hall:theta.VAL", 2.0))
        self.assertEqual((self.get("hall:theta.RBV"), self.get("lab2:theta.RBV")), (2.0, 1.0))
        self.assertEqual(self.end_both(), {"hall": 200, "lab2": 100})

    def test_one_that_comes_later_is_shown_then(self):
        self.bring_up("hall")
        self.bridge = self.start_bridge()
        self.put("hall:theta.VAL", 1.0)
        self.bring_up("lab2")
        self.put("lab2:theta.VAL", 2.0)
        self.assertEqual(self.end_both(), {"hall": 100, "lab2": 200})

    def test_what_screens_name_is_listed_and_found(self):
        self.bring_up("hall")
        self.bring_up("lab2")
        options = [word for name in ("hall", "lab2") for word in ("--daemon", f"{name}={self.file(name) / 'control'}")]
        command = [sys.executable, "-B", "-m", "bushd_epics", "--prefix", "LAB:", *options]
        listed = set(self.run_program(*command, "--list").stdout.split())
        ran = self.run_program(*command, "--screens", self.file("screens"))
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        named = screen_names(self.file("screens"))
        self.assertEqual({name for name in named if name.removesuffix("$") not in listed}, set())
        self.bridge = self.start_bridge()
        of_one = sorted(name.removeprefix("LAB:") for name in named if ":hall:theta" in name)
        self.assertGreater(len(of_one), 40)
        for name in of_one:
            self.get(name)


def screen_names(folder):
    """As the motors' files and the overview open them."""
    names = set()
    for file in folder.glob("*.bob"):
        for embedded in ET.fromstring(file.read_bytes()).iterfind("widget[@type='embedded']"):
            prefix, motor = embedded.findtext("macros/P"), embedded.findtext("macros/M")
            text = pathlib.Path(folder, embedded.findtext("file")).read_text().replace("$(P)", prefix).replace("$(M)", motor)
            names |= {name.text.removeprefix("ca://") for name in ET.fromstring(text).iter("pv_name")}
    return names


class Axes(LabTest):
    def test_an_axis_moves_its_motors(self):
        self.bring_up_lab(more=SLIT)
        heard = self.watch("gap.DMOV", "gap.RBV")
        self.put("gap.VAL", 4.0)
        told = heard.take()
        self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
        self.assertAlmostEqual(self.get("gap.RBV"), 4.0, places=6)
        for name, stands in (("theta", -2.0), ("phi", 2.0)):  # others have moved these: their states come when they come
            self.wait_for(f"{name}.DMOV", lambda dmov: dmov == 1)
            self.wait_for(f"{name}.RBV", lambda rbv, stands=stands: rbv == stands)
        self.assertTrue(self.put_fails("gap.VAL", 101.0))
        self.assertEqual((self.get("gap.LVIO"), self.get("gap.SEVR")), (1, 2))
        self.put("gap.VAL", 2.0)
        self.assertEqual(self.get("gap.SEVR"), 0)
        self.end_all()
        self.assertEqual((self.steps_made("theta"), self.steps_made("phi")), (-100, 100))

    def test_a_stop_of_an_axis_is_that_of_its_motors(self):
        self.bring_up_lab(more=SLIT)
        self.put("centre.VELO", 1.0)
        self.put("centre.VAL", 40.0, wait=False)
        self.wait_for("centre.RBV", lambda rbv: rbv > 0.5)
        self.put("centre.STOP", 1)
        self.wait_for("centre.DMOV", lambda dmov: dmov == 1)
        self.assertEqual(self.get("centre.SEVR"), 2)
        for name in ("theta", "phi"):
            self.wait_for(f"{name}.DMOV", lambda dmov: dmov == 1)
        stand = [self.get(f"{name}.RBV") for name in ("theta", "phi")]
        self.assertLess(max(stand), 39.0)
        self.end_all()
        self.assertEqual([self.steps_made(name) for name in ("theta", "phi")], [round(at * 100) for at in stand])

    def test_what_belongs_to_motors_is_refused(self):
        self.bring_up_lab(more=SLIT)
        for field, value in (("HOMF", 1), ("JOGF", 1), ("OFF", 1.0), ("SET", 1)):
            self.assertTrue(self.put_fails(f"gap.{field}", value), field)
        self.assertEqual((self.get("gap.SET"), self.get("gap.DMOV")), (0, 1))
        self.end_all()
        self.assertEqual((self.steps_made("theta"), self.steps_made("phi")), (0, 0))


class Homing(LabTest):
    def test_homing_finds_the_switch_and_makes_the_position_known(self):
        self.bring_up_lab(theta=HOME, sim=HOME_SWITCH, known=False)
        self.assertEqual(self.get("theta.MSTA") & 1 << 14, 0)
        heard = self.watch("theta.DMOV", "theta.RBV", "theta.HOMF")
        self.put("theta.HOMF", 1)
        told = heard.take()
        self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
        self.assertEqual([value for field, value, _ in told if field == "HOMF"], [1, 0])
        self.assertEqual(self.get("theta.MSTA") & 1 << 14, 1 << 14)
        self.assertEqual(self.get("theta.SEVR"), 0)
        # One step of the edge belongs to either side.
        stands = round(self.get("theta.RBV") * 100)
        self.assertIn(stands - -50, (-1, 0))
        self.put("theta.VAL", 1.0)
        self.end_all()
        self.assertIn(self.steps_made("theta") - 100 - (-300 - -50), (-1, 0, 1))

    def test_a_motor_without_a_home_switch_says_so(self):
        self.bring_up_lab()
        self.assertTrue(self.put_fails("theta.HOMR", 1))
        self.assertIn("home", self.get("theta.AMSG$", as_string=True))
        self.assertEqual([self.get(f"theta.{field}") for field in ("HOMR", "DMOV", "SEVR")], [0, 1, 2])


class Drivers(LabTest):
    def test_cnen_is_that_of_all_motors_of_the_mcu(self):
        self.bring_up_lab()
        for value in (0, 1):
            self.put("theta.CNEN", value)
            for name, is_enabled in (("theta", value), ("phi", value), ("chi", 1)):
                self.wait_for(f"{name}.CNEN", lambda cnen, wanted=is_enabled: cnen == wanted)
                self.assertEqual(bool(self.get(f"{name}.MSTA") & 1 << 5), bool(is_enabled))
        self.put("theta.VAL", 1.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 100)

    def test_a_motor_whose_drivers_are_disabled_is_not_moved(self):
        self.bring_up_lab()
        self.put("theta.CNEN", 0)
        self.wait_for("theta.CNEN", lambda cnen: cnen == 0)
        self.assertTrue(self.put_fails("theta.VAL", 1.0))
        self.assertEqual([self.get(f"theta.{field}") for field in ("DMOV", "SEVR")], [1, 2])
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)


class Alone(LabTest):
    def test_without_p4p_it_is_channel_access_alone_and_says_so(self):
        self.bring_up_lab()
        self.bridge.end()
        hidden = "import sys; sys.modules['p4p'] = None; from bushd_epics.main import main; sys.exit(main())"
        self.bridge = self.start([sys.executable, "-B", "-c", hidden, "--prefix", "LAB:", "--daemon", self.file("control")], "alone.log")
        self.wait_until("bushd-epics to be ready", lambda: "ready" in self.bridge.said())
        self.assertEqual(len([line for line in self.bridge.said().splitlines() if "p4p" in line]), 1, self.bridge.said())
        self.put("theta.VAL", 1.0)
        self.assertEqual(self.get("theta.RBV"), 1.0)

    def test_screens_of_a_daemon_that_is_not_there_are_not_written(self):
        command = [sys.executable, "-B", "-m", "bushd_epics", "--prefix", "LAB:", "--daemon", self.file("control"), "--screens", self.file("screens")]
        ran = subprocess.run(command, capture_output=True, text=True, timeout=60)
        self.assertEqual((ran.returncode, ran.stdout, self.file("screens").exists()), (1, "", False))
        self.assertIn("bushd is not running", ran.stderr)


if __name__ == "__main__":
    unittest.main()
