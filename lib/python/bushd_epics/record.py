"""A motor record: what each put means. Without caproto, without a socket and without a clock: the time is told.

`put` takes a value that a client has put, `observe` what the daemon tells of the motor, and `accepted`, `refused`, `ended` and `lost`
what has become of something that was asked for. After each of them `take` has what is to be done.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from . import events
from .events import Seen
from .fields import FIELDS, Value
from .motions import GO, MOVE_ONCE, PAUSE, STOP, Job, Mip, Motions

TARGETS = ("VAL", "DVAL", "RVAL", "RLV", "TWF", "TWR")  # a put to these makes DMOV fall
SET_TIMES_OUT_S = 30.0
SET_IS_REMEMBERED_S = 600.0  # so long after its time-out a target is taken for one that was meant for SET


@dataclasses.dataclass(frozen=True)
class Putter:
    """Who puts."""

    who: Any = None  # for the daemon's history
    circuit: Any = None  # ends when the client does
    token: Any = None  # is answered once the put is over


class Record(Motions):
    def __init__(self, name: str, is_axis: bool = False, set_times_out_s: float = SET_TIMES_OUT_S) -> None:
        super().__init__(name, is_axis)
        self._asked: dict[int, list[Any]] = {}  # puts that wait for what is no motion
        self._limits_asked: tuple[int, tuple[float, ...]] | None = None
        self._set_times_out_s = set_times_out_s
        self._set_until: float | None = None
        self._set_lapsed_until: float | None = None
        self._spmg_asked: tuple[int, int] | None = None  # a pause or its end that the daemon has not answered, and the word it is for
        self._setters = {
            "STOP": self._put_stop, "SPMG": self._put_spmg, "SYNC": self._put_sync, "STUP": self._put_stup, "PROC": self._put_nothing,
            "JOGF": self._put_jog, "JOGR": self._put_jog, "HOMF": self._put_home, "HOMR": self._put_home, "CNEN": self._put_enable,
            "VELO": self._put_speed, "BVEL": self._put_speed, "JVEL": self._put_speed, "HVEL": self._put_speed,
            "TWV": self._put_number, "BDST": self._put_number, "DLY": self._put_delay, "FOFF": self._put_frozen,
            "SET": self._put_set, "SUSE": self._put_set, "SSET": self._put_set, "VOF": self._put_frozen, "FOF": self._put_frozen,
            "OFF": self._put_offset, "DIR": self._put_direction,
            "HLM": self._put_limit, "LLM": self._put_limit, "DHLM": self._put_limit, "DLLM": self._put_limit,
        }

    # -- clients

    def put(self, field: str, value: Value, by: Putter, now: float) -> None:
        spec = FIELDS[field]
        if not spec.settable:
            return self._reject(field, by, spec.why_not)
        if isinstance(value, float) and not math.isfinite(value):
            return self._reject(field, by, f"{value} is no number that a motor can be given")
        if field in TARGETS:
            self._put_target(field, float(value), by, now)
        else:
            self._setters[field](field, value, by, now)

    def client_gone(self, circuit: Any, now: float) -> None:
        """What its client alone keeps up ends with it: jogs, and targets that are deferred."""
        for job in list(self.jobs.values()):
            if job.kind == "jog" and job.circuit is circuit:
                self._end_jog(job)
        self.drop_deferred("its client has gone before the deferred moves began", now, circuit)

    # -- the daemon

    def observe(self, seen: Seen, now: float) -> None:
        if self.is_late(seen.moving or seen.busy, now):
            return
        self.seen = seen
        self.silent = ""
        self.show()
        self.follow(now)

    def comes_to_rest(self, seen: Seen, now: float) -> None:
        """At the end of a motion that the record has not asked for."""
        self.observe(seen, now)
        self.expect_late(now)

    def fall_silent(self, why: str, now: float) -> None:
        """Nothing is heard of the motor any more; what was asked for is told by `lost` and `refused`."""
        self.silent = why
        self.drop_deferred(why, now)
        if self.external:
            self.external = False
            self._wait_for_link([], why, now)
        self.raise_alarm(self._alarm_now())
        self.show_status()

    def refused(self, number: int, reason: str, now: float) -> None:
        job = self.jobs.get(number)
        if job is not None:
            if job.target is not None and not self.within_limits(job.target):
                self.post("LVIO", 1)
            self.motion_refused(job, reason, now)
        self._spmg_answered(number, reason)
        self._answer(number, reason)

    def ended(self, number: int, outcome: str, reason: str, now: float) -> None:
        job = self.jobs.get(number)
        if job is not None:
            if job.kind == "jog" and outcome == events.End.LIMIT and not (self.seen.plus_limit or self.seen.minus_limit):
                self.post("LVIO", 1)
            self.motion_ended(job, outcome, reason, now)
        error = "" if outcome == events.End.REACHED else reason or outcome
        self._spmg_answered(number, error)
        self._answer(number, error)

    def lost(self, number: int, reason: str, now: float) -> None:
        job = self.jobs.get(number)
        if job is not None:
            self.motion_lost(job, reason, now)
        self._spmg_answered(number, reason)
        self._answer(number, reason)

    # -- the clock

    def wake_at(self) -> float | None:
        """When `tick` is to be called at the latest."""
        times = [time for time in (self.motion_deadline(), self._set_until) if time is not None]
        return min(times, default=None)

    def tick(self, now: float) -> None:
        self.motion_tick(now)
        if self._set_until is not None and now >= self._set_until:
            self._leave_set(now)

    # -- targets

    def _put_target(self, field: str, value: float, by: Putter, now: float) -> None:
        target = self._user_target(field, value)
        if self.values["SET"] != 1:
            self.fall()
        self.post(field, value, always=field in ("RLV", "TWF", "TWR"))
        if field in ("RLV", "TWF", "TWR"):
            self.post(field, 0.0 if field == "RLV" else 0)
        if self.values["SET"] == 1:
            return self._set_position(field, target, by, now)
        reason = self._set_has_ended(now) or self._why_not(target)
        if reason:
            self._log_refused(field, by, reason)
            return self.refuse(by.token, reason, now)
        legs = self._legs(target)
        outside = [to for to, _ in legs if not self.within_limits(to)]
        if outside and self.within_limits(target):
            self.post("LVIO", 1)
            reason = f"it would begin its approach at {outside[0]:g}, beyond its soft limits (BDST)"
            self._log_refused(field, by, reason)
            return self.refuse(by.token, reason, now)
        self.begin(Job("move", [by.token], by.who, by.circuit, Mip.MOVE, target, legs), now)

    def _user_target(self, field: str, value: float) -> float:
        scale, val = self.seen.scale, self.number("VAL")
        if field == "DVAL":
            return scale.user(value)
        if field == "RVAL":
            return scale.user(value * scale.resolution)
        if field == "RLV":
            return val + value
        if field in ("TWF", "TWR"):
            return val + self.number("TWV") * (1 if field == "TWF" else -1)
        return value

    def _set_has_ended(self, now: float) -> str:
        """Who has put SET and waited too long means to say where the motor stands: the next target is not to move it."""
        lapsed_until, self._set_lapsed_until = self._set_lapsed_until, None
        if lapsed_until is None or now >= lapsed_until:
            return ""
        return f"SET has ended after {self._set_times_out_s:g} s without use: put SET 1 again or put the target once more"

    def _why_not(self, target: float) -> str:
        if self.silent:
            return self.silent
        if not math.isfinite(target):
            return "nobody knows where the motor stands"
        if self.values["SPMG"] == STOP:
            return "SPMG is Stop"
        job = self.job
        if job is not None and job.kind != "move":
            return "it jogs" if job.kind == "jog" else "it is being homed"
        return ""

    def _legs(self, target: float) -> list[tuple[float, float | None]]:
        """Against the backlash, or farther than it: first to where the approach begins."""
        backlash, scale, here = self.number("BDST"), self.seen.scale, self.seen.dial
        if abs(backlash) < abs(scale.resolution) or here is None:
            return [(target, self.floor("VELO"))]
        way = scale.dial(target) - here
        approach = (target, self.floor("BVEL"))
        if way * backlash < 0 or abs(way) > abs(backlash):
            return [(scale.user(scale.dial(target) - backlash), self.floor("VELO")), approach]
        return [approach]

    def _set_position(self, field: str, target: float, by: Putter, now: float) -> None:
        """SET is 1: nothing moves. The dial is set by DVAL and RVAL, and by VAL where the offset is frozen."""
        self._set_until = now + self._set_times_out_s
        if self.silent:
            return self._reject(field, by, self.silent)
        if self.in_motion:
            self.place_target()
            return self._reject(field, by, "it moves: its position is set at rest")
        by_dial = field in ("DVAL", "RVAL") or self.values["FOFF"] == 1
        number = self.next_number()
        self._asked[number] = [by.token]
        to = self.seen.scale.dial(target) if by_dial else target
        self.ask(events.SetPosition(number, by.who, to, by_dial))

    # -- motions

    def _put_stop(self, field: str, value: Value, by: Putter, now: float) -> None:
        if value:
            self._stop(by, now)
        else:
            self.done([by.token])

    def _stop(self, by: Putter, now: float) -> None:
        """Its put is over when the daemon has answered. Where nobody answers it is sent nevertheless, and has failed at once."""
        number = self.halt(by.who, now)
        if self.silent:
            self.done([by.token], self.silent)
        elif number is None:
            self.done([by.token])
        else:
            self._asked[number] = [by.token]

    def _put_spmg(self, field: str, value: Value, by: Putter, now: float) -> None:
        """A pause, and its end, is shown when the daemon has carried it out: a refusal leaves SPMG as it was."""
        word, paused = int(value), self.values["SPMG"] == PAUSE or self.pausing
        self._spmg_asked, self.pausing = None, False
        if word == STOP:
            self._show_spmg(word)
            return self._stop(by, now)
        if word == PAUSE:
            for job in self.jobs.values():
                if job.kind == "jog":
                    self._end_jog(job)
            if self.values["SPMG"] != PAUSE and self._daemon_has_motion():
                self.pausing = True
                return self._ask_spmg(events.Pause(self.next_number(), by.who), word, by)
        elif paused and self.waiting is None and self._daemon_has_motion():
            return self._ask_spmg(events.Resume(self.next_number(), by.who), word, by)
        self._show_spmg(word)
        if word != PAUSE:
            self._begin_waiting()
        self.done([by.token])

    def _daemon_has_motion(self) -> bool:
        return any(job.kind != "jog" and not job.deferred for job in self.jobs.values())

    def _ask_spmg(self, ask: events.Ask, word: int, by: Putter) -> None:
        self._spmg_asked = (self.ask(ask), word)
        self._asked[ask.number] = [by.token]

    def _spmg_answered(self, number: int, error: str) -> None:
        if self._spmg_asked is None or self._spmg_asked[0] != number:
            return  # another word has been put since
        word = self._spmg_asked[1]
        self._spmg_asked, self.pausing = None, False
        if error:
            self.log(f"a put to SPMG is refused: {error}")
            self.post("SPMG", self.values["SPMG"], always=True)
        else:
            self._show_spmg(word)
        if self.values["SPMG"] in (GO, MOVE_ONCE):
            self._begin_waiting()

    def _show_spmg(self, word: int) -> None:
        self.post("LSPG", self.values["SPMG"])
        self.post("SPMG", word)

    def _begin_waiting(self) -> None:
        if self.waiting is not None:
            job, self.waiting = self.waiting, None
            self.issue(job)

    def _put_jog(self, field: str, value: Value, by: Putter, now: float) -> None:
        if not value:
            mip = Mip.JOGF if field == "JOGF" else Mip.JOGR
            for job in list(self.jobs.values()):
                if job.kind == "jog" and job.mip == mip:
                    self._end_jog(job)
            return self.done([by.token])
        reason = "it moves" if self.in_motion else self._why_not(0.0) or ("SPMG is Pause" if self.values["SPMG"] == PAUSE else "")
        if reason:
            self.post(field, self.values[field], always=True)
            return self._reject(field, by, reason)
        up = field == "JOGF"
        self.fall()
        self.post(field, 1)
        self.post_all({"TDIR": int(up), "CDIR": int(up != self.seen.scale.negative), "LVIO": 0})
        speed = self.number("JVEL") * (1 if up else -1)
        self.begin(Job("jog", [by.token], by.who, by.circuit, Mip.JOGF if up else Mip.JOGR, speed=speed), now)

    def _end_jog(self, job: Job) -> None:
        if not job.stopping:
            job.stopping = True
            self.ask(events.EndJog(self.next_number(), job.who, job.number))

    def _put_home(self, field: str, value: Value, by: Putter, now: float) -> None:
        if not value:
            return self.done([by.token])
        reason = "it moves" if self.in_motion else self._why_not(0.0)
        if reason:
            return self._reject(field, by, reason)
        self.fall()
        self.post(field, 1)
        mip = Mip.HOMF if field == "HOMF" else Mip.HOMR
        self.begin(Job("home", [by.token], by.who, by.circuit, mip, speed=self.floor("HVEL")), now)

    def _put_sync(self, field: str, value: Value, by: Putter, now: float) -> None:
        if value and not self.in_motion:
            self.place_target()
        self.done([by.token])

    def _put_stup(self, field: str, value: Value, by: Putter, now: float) -> None:
        """The position is told whenever it changes: there is nothing to be read again."""
        self.post("STUP", 0, always=True)
        self.done([by.token])

    def _put_nothing(self, field: str, value: Value, by: Putter, now: float) -> None:
        self.done([by.token])

    # -- settings of the record

    def _put_number(self, field: str, value: Value, by: Putter, now: float) -> None:
        self.post(field, float(value), always=True)
        self.done([by.token])

    def _put_delay(self, field: str, value: Value, by: Putter, now: float) -> None:
        if not 0 <= float(value) <= 3600:
            return self._reject(field, by, "a time to settle is 0 to 3600 s")
        self._put_number(field, value, by, now)

    def _put_speed(self, field: str, value: Value, by: Putter, now: float) -> None:
        """Beyond VMAX it is VMAX: clients that wait for the value they have put would wait for ever otherwise."""
        speed = float(value)
        if speed <= 0:
            return self._reject(field, by, f"a speed of {speed:g}: it is to be above 0")
        least = 0.0 if self.is_axis else self.seen.scale.least_speed
        if speed < least:
            return self._reject(field, by, f"a speed of {speed:g}: allowed is down to a step an hour, which is {least:.6g}")
        if speed > self.top:
            self.log(f"{field} {speed:g} is above VMAX: it is {self.top:g}")
        self.post(field, min(speed, self.top), always=True)
        turns = {"VELO": "S", "BVEL": "SBAK"}.get(field)
        if turns is not None:
            self.post(turns, self._turns(self.number(field), self.seen.scale.resolution))
        self.done([by.token])

    def _put_frozen(self, field: str, value: Value, by: Putter, now: float) -> None:
        word = {"VOF": 0, "FOF": 1}.get(field, int(value))
        self.post("FOFF", word)
        self.done([by.token])

    def _put_set(self, field: str, value: Value, by: Putter, now: float) -> None:
        word = {"SUSE": 0, "SSET": 1}.get(field, int(value))
        if word == 1 and self.is_axis:
            return self._reject(field, by, "a pseudo-axis is computed: set its motors")
        self.post("SET", word)
        self._set_until = now + self._set_times_out_s if word else None
        self._set_lapsed_until = None
        self.done([by.token])

    def _leave_set(self, now: float) -> None:
        self._set_until = None
        self._set_lapsed_until = now + SET_IS_REMEMBERED_S
        self.log(f"SET is Use again: nobody has used it for {self._set_times_out_s:g} s")
        self.post("SET", 0)

    # -- settings of the motor

    def _put_offset(self, field: str, value: Value, by: Putter, now: float) -> None:
        self._configure({"offset": float(value)}, by)

    def _put_direction(self, field: str, value: Value, by: Putter, now: float) -> None:
        self._configure({"direction": "negative" if int(value) else "positive"}, by)

    def _put_limit(self, field: str, value: Value, by: Putter, now: float) -> None:
        """bushd has them on the dial; both at 0 are none. One that is put while another is still on its way leaves that as it was put."""
        scale = self.seen.scale
        dial = list(self._limits_asked[1] if self._limits_asked is not None else (self.number("DLLM"), self.number("DHLM")))
        is_high = field in ("HLM", "DHLM")
        bound = float(value) if field.startswith("D") else scale.dial(float(value))
        if field in ("HLM", "LLM") and dial == [0.0, 0.0]:  # none: the other one is 0 on the user's scale, as it is shown
            dial = [scale.dial(0.0), scale.dial(0.0)]
        dial[is_high if field.startswith("D") else is_high != scale.negative] = bound
        if dial[0] > dial[1]:
            return self._reject(field, by, "the low limit would be above the high one")
        none = dial == [0.0, 0.0] or [scale.user(one) for one in dial] == [0.0, 0.0]
        number = self._configure({"soft_limits": None if none else tuple(dial)}, by)
        self._limits_asked = (number, tuple(dial))

    def _put_enable(self, field: str, value: Value, by: Putter, now: float) -> None:
        number = self.next_number()
        self._asked[number] = [by.token]
        self.ask(events.Enable(number, by.who, bool(value)))

    def hold(self, on: bool, by: Putter) -> None:
        """`_able` of clients: a motor that is held begins no motion."""
        number = self.next_number()
        self._asked[number] = [by.token]
        self.ask(events.Hold(number, by.who, on))

    def _configure(self, changes: dict[str, Any], by: Putter) -> int:
        number = self.next_number()
        self._asked[number] = [by.token]
        return self.ask(events.Configure(number, by.who, tuple(changes.items())))

    # -- answers

    def _answer(self, number: int, error: str) -> None:
        if self._limits_asked is not None and self._limits_asked[0] == number:
            self._limits_asked = None
        tokens = self._asked.pop(number, None)
        if tokens is not None:
            self.done(tokens, error)

    def _reject(self, field: str, by: Putter, reason: str) -> None:
        """A put that nothing comes of; clients that show the field get it as it is."""
        self._log_refused(field, by, reason)
        self.post(field, self.values[field], always=True)
        self.done([by.token], reason)

    def _log_refused(self, field: str, by: Putter, reason: str) -> None:
        self.log(f"a put to {field} by {by.who} is refused: {reason}")
