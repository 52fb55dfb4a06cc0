"""Motors of bushd in Sardana, by one file: put its folder into PoolPath, then

    defctrl BushdMotorController bushd Motors "theta,phi" Socket /run/bushd/control
    defelem theta bushd 1
    defelem phi bushd 2

Axis 1 is the first of Motors, and so on. Positions are those of bushd, in its unit and on its user's scale; they are Sardana's dial.
Motors of one motion are one request of the daemon: on one bus they start in the same tick. What the daemon refuses fails the
start; what ends before its target leaves the motor in Alarm, with the daemon's reason as status, until the next start.
A position that is not known is not read.

It needs the package bushd, of the same version as the daemon.
"""

import bushd
from bushd.devices import trusted
from sardana import State
from sardana.pool.controller import Access, DataAccess, DefaultValue, Description, MotorController, Type


class BushdMotorController(MotorController):
    """Motors of one daemon."""

    ctrl_properties = {
        "Motors": {Type: str, Description: "names in bushd.toml, with commas between; axis 1 is the first"},
        "Socket": {Type: str, Description: "the daemon's control socket; empty: as 'bushctl' finds it", DefaultValue: ""},
    }
    axis_attributes = {
        "Trust": {Type: str, Description: "what the position is worth: known, restored, stale, uncertain, unknown", Access: DataAccess.ReadOnly},
        "LowerLimit": {Type: float, Description: "soft limit of bushd.toml", Access: DataAccess.ReadOnly},
        "UpperLimit": {Type: float, Description: "soft limit of bushd.toml", Access: DataAccess.ReadOnly},
    }
    gender = "Motor"
    model = "bushd"
    organization = "bushd"

    def __init__(self, inst, props, *args, **kwargs):
        super().__init__(inst, props, *args, **kwargs)
        self._names = [name.strip() for name in self.Motors.split(",") if name.strip()]
        self.MaxDevice = len(self._names)
        self._client = None
        self._targets = {}  # of the motion that is being put together
        self._motions = {}  # by motor: the last one of this controller
        self._stopped = set()  # motors that this controller has stopped since
        self._status = None

    def AddDevice(self, axis):
        if not 1 <= axis <= len(self._names):
            raise ValueError(f"axis {axis}: Motors names {len(self._names)}")

    def DeleteDevice(self, axis):
        self._motions.pop(self._name(axis), None)

    # -- states and positions: one question for all axes

    def StateAll(self):
        self._status = self._ask(lambda client: client.status())

    def StateOne(self, axis):
        motor = self._status[self._name(axis)]
        state, text = self._state_of(motor)
        return state, text, self._switches_of(motor)

    def ReadAll(self):
        self._status = self._ask(lambda client: client.status())

    def ReadOne(self, axis):
        return trusted(self._status[self._name(axis)]).position

    def _state_of(self, motor):
        motion = self._motions.get(motor.name)
        if motor.moving or (motion is not None and not motion.done):
            return State.Moving, f"moves to {motor.target} {motor.unit}"
        try:
            trusted(motor)
        except bushd.BushdError as untrusted:
            lost = motor.trust is not bushd.Trust.UNCERTAIN
            return (State.Fault if lost else State.Alarm), str(untrusted)
        failure = None if motion is None else self._failure_of(motion, motor.name)
        if failure is not None:
            return State.Alarm, failure
        if motor.inhibited is not bushd.Inhibited.NONE:
            return State.Alarm, f"a limit switch inhibits the direction {motor.inhibited.value}"
        return State.On, str(motor)

    def _failure_of(self, motion, name):
        """Why this motor is not where the motion was to bring it."""
        try:
            result = motion.wait(check=False)
        except bushd.BushdError as error:  # the daemon has ended meanwhile
            return str(error)
        outcome = result[name].outcome
        as_wanted = outcome.succeeded or (outcome is bushd.Outcome.STOPPED and name in self._stopped)
        return None if as_wanted else result.reason

    def _switches_of(self, motor):
        """A limit counts in its direction only: a motor may leave it."""
        ways = {bushd.Inhibited.POSITIVE: 2, bushd.Inhibited.NEGATIVE: 4, bushd.Inhibited.BOTH: 6}
        limits = ways.get(motor.inhibited, 0)
        return limits | (self.HomeLimitSwitch if "home" in motor.inputs else self.NoLimitSwitch)

    # -- motion

    def PreStartAll(self):
        self._targets = {}

    def PreStartOne(self, axis, position):
        return True

    def StartOne(self, axis, position):
        self._targets[self._name(axis)] = float(position)

    def StartAll(self):
        targets, self._targets = self._targets, {}
        status = self._ask(lambda client: client.status())
        for name in targets:
            trusted(status[name])
        motion = self._ask(lambda client: client.move(targets, wait=False))
        self._stopped -= targets.keys()
        self._motions.update(dict.fromkeys(targets, motion))

    def StopOne(self, axis):
        """Ramps down. Steps are not lost."""
        name = self._name(axis)
        motion = self._motions.get(name)
        if motion is not None and not motion.done:  # the pool also stops what has ended in Alarm
            self._stopped.add(name)
        self._ask(lambda client: client.stop(name, wait=False))

    def AbortOne(self, axis):
        """The same: what stops at once loses steps. For that there is bushd's emergency stop."""
        self.StopOne(axis)

    def DefinePosition(self, axis, position):
        """Says where the motor stands; it is known then."""
        name = self._name(axis)
        self._ask(lambda client: client.set_position(name, float(position)))
        self._ask(lambda client: client.confirm(name))
        self._motions.pop(name, None)

    # -- parameters

    def GetAxisPar(self, axis, parameter):
        motor = self._motor(axis)
        a_unit = _number(motor.steps_per_unit)
        table = self._ask(lambda client: client.tables.get(f"{motor.table.name}"))
        to_s = table.time_unit_ns / 1e9
        decel = table.decel or table.accel
        fastest = table.cruise or table.accel[-1]
        values = {
            "step_per_unit": lambda: 1.0,  # positions are in units already
            "velocity": lambda: min(1 / (fastest * to_s) / a_unit, self._max_speed(motor)),
            "base_rate": lambda: 1 / (table.accel[0] * to_s) / a_unit,
            "acceleration": lambda: sum(table.accel) * to_s,
            "deceleration": lambda: sum(decel) * to_s,
        }
        return values[parameter.lower()]()

    def SetAxisPar(self, axis, parameter, value):
        """The velocity is that of the motor's table, or less."""
        if parameter.lower() == "velocity":
            self._ask(lambda client: client.config(self._name(axis), max_speed=float(value)))
        elif self.GetAxisPar(axis, parameter) != value:
            raise ValueError(f"{self._name(axis)}: {parameter} is that of its table; give its group another one ('bushctl table use')")

    def GetAxisExtraPar(self, axis, parameter):
        motor = self._motor(axis)
        low, high = motor.soft_limits or (float("-inf"), float("inf"))
        return {"trust": motor.trust.value, "lowerlimit": low, "upperlimit": high}[parameter.lower()]

    # -- the daemon

    def _name(self, axis):
        return self._names[axis - 1]

    def _motor(self, axis):
        return self._ask(lambda client: client.where(self._name(axis)))

    def _max_speed(self, motor):
        settings = self._ask(lambda client: client.config(motor.name)).settings
        said = [setting.value for setting in settings if setting.key == "max_speed"]
        return _number(said[0]) if said and said[0] not in ("", "none") else float("inf")

    def _ask(self, what):
        """After a restart of the daemon by a new connection. What was sent once is not sent again."""
        if self._client is not None and not self._client.connected:
            self._client.close()
            self._client = None
        if self._client is None:
            self._client = bushd.connect(self.Socket or None)
        return what(self._client)


def _number(text):
    """"320" or "1/3"."""
    over, _, under = text.partition("/")
    return float(over) / float(under or 1)
