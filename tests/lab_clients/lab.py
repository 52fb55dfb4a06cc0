"""What the tests with lab clients share: bushsim, bushd and bushd-epics in a folder and a network of their own, and what is heard of them.

Fields are watched by pyepics, so what is asserted is what a client hears, in the order in which it hears it.
"""

import faulthandler
import os
import pathlib
import sys
import time

ADDRESS = "127.0.0.1"
os.environ.update(
    EPICS_CA_ADDR_LIST=ADDRESS,
    EPICS_CA_AUTO_ADDR_LIST="NO",
    EPICS_CAS_INTF_ADDR_LIST=ADDRESS,
    EPICS_CAS_BEACON_ADDR_LIST=ADDRESS,
    EPICS_CAS_AUTO_BEACON_ADDR_LIST="NO",
    EPICS_PVA_ADDR_LIST=ADDRESS,
    EPICS_PVA_AUTO_ADDR_LIST="NO",
    EPICS_PVAS_INTF_ADDR_LIST=ADDRESS,
    EPICS_PVAS_BEACON_ADDR_LIST=ADDRESS,
    EPICS_PVAS_AUTO_BEACON_ADDR_LIST="NO",
)
# A plan that hangs says where. In seconds: before its test is ended, by TIMEOUT in CMakeLists.txt.
faulthandler.dump_traceback_later(270)
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))

from caproto.sync import client as caproto_client
from rig import GIVE_UP_S, EndToEndTest, Trace

# By name: (address, output). 100 steps are a degree.
PLACES = {"theta": (1, 0), "phi": (1, 1), "chi": (2, 0)}
STEPS = 100
TOP = 25.0  # degrees a second, of bushd2-constant: 2500 steps/s


def configuration(folder, theta="", more=""):
    """`theta`: keys of this motor; `more`: sections."""
    lines = ['[lcm]\nurl = "memq://"', f'[control]\npath = "{folder}/control"', f'[state]\npath = "{folder}/state"']
    lines += [f'[[bus]]\nname = "hall"\nport = "{folder}/port"\nbaud = 500000\ntick_us = 2560\nformat = "fine"']
    lines += [f'[[mcu]]\nbus = "hall"\naddress = {address}' for address in (1, 2)]
    lines += ['[[group]]\nname = "all"\ntable = "bushd2-constant"']
    for name, (address, output) in PLACES.items():
        lines += [f'[[motor]]\nname = "{name}"\nmcu = "hall:{address}"\noutput = {output}\ngroup = "all"']
        lines += [f'unit = "deg"\nsteps_per_unit = {STEPS}\nsoft_limits = [-500, 500]']
        lines += [theta] if name == "theta" else []
    lines += [more]
    return "\n".join(lines) + "\n"


def pyepics():
    """Imported when it is used: where it is, ophyd-async shares its context of libca, which has one for each thread."""
    import epics

    return epics


# ophyd 1.11 tells a plan that a move has ended, and then, in another thread, forgets who waits for an end: the plan's next move, if that
# has begun by then, and the plan waits for ever. The thread is expected to run within this time.
SETTLE_S = 0.25


class LabTest(EndToEndTest):
    def bring_up_lab(self, theta="", bridge=(), sim=(), known=True, more=""):
        """`known`: somebody has said that all motors stand at 0."""
        self.file("bushd.toml").write_text(configuration(self.folder, theta, more))
        self.bushsim = self.start_bushsim(options=sim)
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        for name in PLACES if known else ():
            self.command("set", name, "--dial", "0")
        self.bridge = self.start_bridge(*bridge)

    def start_bridge(self, *options):
        command = [sys.executable, "-B", "-m", "bushd_epics", "--prefix", "LAB:", "--daemon", self.file("control"), *map(str, options)]
        bridge = self.start(command, f"bushd-epics-{len(self.programs)}.log")
        self.wait_until("bushd-epics to be ready", lambda: "ready" in bridge.said() or not bridge.lives())
        self.assertTrue(bridge.lives(), bridge.said())
        return bridge

    # -- what clients see

    def epics_motor(self, name):
        """ophyd's EpicsMotor of this name, connected."""
        from ophyd import EpicsMotor

        motor = EpicsMotor(f"LAB:{name}", name=name, settle_time=SETTLE_S)
        motor.wait_for_connection(timeout=20)
        return motor

    def get(self, name, **how):
        # Asked for each time: the answer to a first get may overwrite a newer value that pyepics has been told meanwhile.
        value = pyepics().caget(f"LAB:{name}", timeout=10, use_monitor=False, **how)
        self.assertIsNotNone(value, name)
        return value

    def get_anew(self, name):
        """By a client that connects only now: one that has lost its connection may look for the bridge some seconds later."""
        return caproto_client.read(f"LAB:{name}", timeout=GIVE_UP_S, repeater=False).data[0]

    def put(self, name, value, wait=True):
        self.assertIsNotNone(pyepics().caput(f"LAB:{name}", value, wait=wait, timeout=GIVE_UP_S), name)

    def put_fails(self, name, value):
        """By caproto, which tells how a put has been answered."""
        response = caproto_client.write(f"LAB:{name}", value, notify=True, timeout=GIVE_UP_S, repeater=False)
        return response.status.name != "ECA_NORMAL"

    def wait_for(self, name, holds):
        self.wait_until(f"{name}", lambda: holds(self.get(name)))

    def watch(self, *names):
        heard = Heard(names)
        self.wait_until("the first values of what is watched", heard.all_connected)
        time.sleep(0.1)  # what came before this is over with the values
        heard.clear()
        return heard

    def steps_made(self, name):
        """By the trace, counted with their signs; only after bushsim has ended."""
        edges = Trace(self.file("trace.vcd")).edges.get(PLACES[name], [])
        return sum(1 if edge.direction else -1 for edge in edges)

    def end_all(self):
        self.assertEqual(self.bridge.end(), 0)
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)


class Heard:
    """Fields as they are heard: (field, value, severity), in order."""

    def __init__(self, names):
        self._heard = []
        self._connected = set()
        self._names = names
        epics = pyepics()
        events = epics.dbr.DBE_VALUE | epics.dbr.DBE_ALARM
        self._variables = [epics.PV(f"LAB:{name}", auto_monitor=events, callback=self._hear, form="time") for name in names]

    def _hear(self, pvname, value, severity, **_):
        name = pvname.removeprefix("LAB:")
        self._connected.add(name)
        self._heard.append((name.partition(".")[2] or name, value, severity))

    def all_connected(self):
        return self._connected == set(self._names)

    def clear(self):
        self._heard.clear()

    def take(self):
        """All since the last time."""
        heard = list(self._heard)
        del self._heard[: len(heard)]
        return heard

    def values(self, field):
        return [value for name, value, _ in list(self._heard) if name == field]
