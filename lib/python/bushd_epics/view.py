"""What a record shows of a motor: positions, switches, limits, and how much of that is to be trusted."""

from __future__ import annotations

import math
from typing import Any

from . import alarms
from .alarms import Alarm, Severity, Status
from .board import Board
from .events import Seen, Speeds


class Msta:
    """Bits of MSTA."""

    DIRECTION = 1 << 0
    DONE = 1 << 1
    PLUS_LIMIT = 1 << 2
    AT_HOME = 1 << 3
    ENABLED = 1 << 5
    SLIP = 1 << 6
    PROBLEM = 1 << 9
    MOVING = 1 << 10
    CAN_ENABLE = 1 << 11
    COMM_ERROR = 1 << 12
    MINUS_LIMIT = 1 << 13
    HOMED = 1 << 14


class View(Board):
    def __init__(self, name: str, is_axis: bool = False) -> None:
        super().__init__(name)
        self.is_axis = is_axis  # a pseudo-axis: computed from motors, without a driver and a table of its own
        self.seen = Seen(live=False)
        self.silent = "bushd has not told yet where it is"  # why nothing is heard of it; "": it is heard
        self.failure: Alarm = alarms.NONE  # of the last motion
        self.top = 1.0  # speed, in units a second: VMAX
        self.slipped = False
        self._scale_shown: Any = None
        self._switches_shown: Any = None

    # -- what the shell tells

    def speeds(self, speeds: Speeds) -> None:
        """How fast it can go; tells the fields of speeds that are beyond that."""
        was = self.top
        self.top = speeds.top
        step = self.seen.scale.resolution
        self.post_all({
            "VMAX": speeds.top,
            "VBAS": min(speeds.least, speeds.top),
            "ACCL": speeds.ramp_s,
            "BACC": speeds.ramp_s,
            "JAR": speeds.top / speeds.ramp_s if speeds.ramp_s > 0 else 0.0,
            "SMAX": self._turns(speeds.top, step),
            "SBAS": self._turns(speeds.least, step),
        })
        for field in ("VELO", "BVEL", "JVEL", "HVEL"):
            follows = self.number(field) == was  # nobody has set it
            self.post(field, speeds.top if follows else min(self.number(field), speeds.top))
        self.post("S", self._turns(self.number("VELO"), step))
        self.post("SBAK", self._turns(self.number("BVEL"), step))

    @staticmethod
    def _turns(speed: float, step: float) -> float:
        """Revolutions a second of 200 steps, as SREV says."""
        return abs(speed / step) / 200

    # -- for the layers above

    def floor(self, field: str) -> float | None:
        """A speed to be asked for; None: as fast as it goes."""
        value = self.number(field)
        return None if value >= self.top * (1 - 1e-9) else value

    def show(self) -> None:
        """All that follows from what was seen, in the order that clients rely on: position, switches, alarm."""
        seen = self.seen
        self._show_scale(seen)
        self._show_position(seen)
        self._show_switches(seen)
        self.raise_alarm(self._alarm_now())
        self.show_status()

    def show_status(self) -> None:
        """MSTA, of what the other fields say."""
        seen, values = self.seen, self.values
        self.post(
            "MSTA",
            Msta.DIRECTION * (bool(values["TDIR"]) != seen.scale.negative)
            | Msta.DONE * (values["DMOV"] == 1)
            | Msta.PLUS_LIMIT * seen.plus_limit
            | Msta.AT_HOME * seen.at_home
            | Msta.ENABLED * seen.enabled
            | Msta.SLIP * self.slipped
            | Msta.PROBLEM * (self.alarm.severity >= Severity.MAJOR)
            | Msta.MOVING * (values["MOVN"] == 1)
            | Msta.CAN_ENABLE * (not self.is_axis)
            | Msta.COMM_ERROR * (bool(self.silent) or not seen.live)
            | Msta.MINUS_LIMIT * seen.minus_limit
            | Msta.HOMED * (seen.user is not None and not seen.uncertain),
        )

    def _alarm_now(self) -> Alarm:
        """The worst of what is so. A number that nobody has heard of lately is INVALID, whatever else is so."""
        seen = self.seen
        if self.silent:
            return Alarm(Status.COMM, Severity.INVALID, self.silent)
        if seen.user is None:
            return Alarm(Status.UDF, Severity.INVALID, seen.uncertain or "its MCU has not reported where it is")
        if not seen.live:
            return Alarm(Status.COMM, Severity.INVALID, seen.uncertain or "its MCU is offline")
        if self.failure.severity is not Severity.NO_ALARM:
            return self.failure
        if seen.uncertain:
            return Alarm(Status.STATE, Severity.MAJOR, f"position uncertain: {seen.uncertain}")
        return alarms.NONE

    def _show_scale(self, seen: Seen) -> None:
        scale = seen.scale
        now = (scale, seen.low, seen.high, seen.unit, seen.precision, seen.description, seen.place, seen.enabled)
        if now == self._scale_shown:  # as nearly always: states come often
            return
        self._scale_shown = now
        low, high = (seen.low, seen.high) if seen.low is not None and seen.high is not None else (0.0, 0.0)
        dials = sorted((scale.dial(low), scale.dial(high))) if seen.low is not None else [0.0, 0.0]
        self.post_all({
            "MRES": scale.resolution,
            "ERES": scale.resolution,
            "RRES": scale.resolution,
            "RDBD": scale.resolution,
            "UREV": 200 * scale.resolution,
            "DIR": int(scale.negative),
            "OFF": scale.offset,
            "EGU": seen.unit,
            "PREC": seen.precision,
            "DESC": seen.description[:40],
            "OUT": seen.place,
            "DHLM": dials[1],
            "DLLM": dials[0],
            "HOPR": high,
            "LOPR": low,
            "HLM": high,
            "LLM": low,
            "CNEN": int(seen.enabled),
        })

    def _show_position(self, seen: Seen) -> None:
        self.post("UDF", int(seen.user is None))
        self.post("MOVN", int(seen.moving))
        if seen.steps is not None:
            steps = _long(seen.steps)
            self.post("RRBV", steps)
            self.post("RMP", steps)
            self.post("REP", steps)
        self.post("RVEL", _long(round(seen.steps_per_s)))
        self.post("DRBV", math.nan if seen.dial is None else seen.dial)
        self.post("RBV", math.nan if seen.user is None else seen.user)
        if seen.dial is not None and seen.steps is not None:
            self.post("DIFF", self.number("DVAL") - seen.dial)
            self.post("RDIF", _long(int(self.number("RVAL")) - seen.steps))

    def _show_switches(self, seen: Seen) -> None:
        high, low = seen.plus_limit, seen.minus_limit
        now = (high, low, seen.at_home, seen.scale.negative)
        if now == self._switches_shown:
            return
        self._switches_shown = now
        self.post_all({"RHLS": int(high), "RLLS": int(low), "ATHM": int(seen.at_home)})
        if seen.scale.negative:
            high, low = low, high
        self.post_all({"HLS": int(high), "LLS": int(low)})

    def show_target(self, user: float) -> None:
        """Where it is to go, in all fields that tell it."""
        if not math.isfinite(user):
            return
        dial = self.seen.scale.dial(user)
        steps = _long(self.seen.scale.steps(dial))
        self.post_all({"LVAL": user, "LDVL": dial, "LRVL": steps, "DVAL": dial, "RVAL": steps, "VAL": user})

    def show_direction(self, user: float) -> None:
        if self.seen.user is not None and user != self.seen.user:
            up = user > self.seen.user
            self.post_all({"TDIR": int(up), "CDIR": int(up != self.seen.scale.negative)})

    def place_target(self) -> None:
        """It is to be where it is."""
        if self.seen.user is not None:
            self.show_target(self.seen.user)


def _long(value: int) -> int:
    """As much as the 32 bits of Channel Access hold."""
    return max(-(2**31), min(2**31 - 1, value))

