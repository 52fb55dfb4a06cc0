"""Motions of a record, which its fields have asked for (record.py): when DMOV falls and rises, and what else is told, in which order, when one ends.

DMOV is 0 from before a motion is asked for until all that belongs to it is over: both legs of backlash, the time to settle, a pause,
a motion that others have asked for. It rises once, after the last position, the switches and the alarm are told, and puts are
answered after that. Where a link is lost nobody knows when the motor stands: then DMOV rises when it is heard at rest, at the
latest after a time in which it must have run down.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from . import alarms, events
from .alarms import Alarm, Severity, Status
from .events import End
from .view import View

# So long a motor that has lost its link is given to run down, beside twice its ramp.
LOST_S = 3.0
# A state that was sent before a motion had ended may come after its result.
LATE_STATE_S = 0.5

GO, MOVE_ONCE, PAUSE, STOP = 3, 2, 1, 0
SUPERSEDED = "the motor was given a new target before it had reached this one"


class Mip:
    """Bits of MIP."""

    JOGF, JOGR, HOMF, HOMR, MOVE, LOAD_P = 0x2, 0x4, 0x8, 0x10, 0x20, 0x80
    MOVE_BL, STOP, DELAY, EXTERNAL = 0x100, 0x200, 0xC00, 0x8000


@dataclasses.dataclass
class Job:
    """A motion that a client has asked for."""

    kind: str  # "move", "home" or "jog"
    tokens: list[Any]
    who: Any
    circuit: Any
    mip: int
    target: float | None = None  # on the user's scale, of a move
    legs: list[tuple[float, float | None]] = dataclasses.field(default_factory=list)  # still to be asked for
    speed: float | None = None
    number: int = 0  # of what is asked for; 0: nothing yet
    accepted: bool = False
    stopping: bool = False
    deferred: bool = False  # gathered, and not sent yet
    failure: Alarm = alarms.NONE  # told at the end, whatever comes: it makes up for backlash after a stop


@dataclasses.dataclass
class Ending:
    """How a motion ends that is over but for the time to settle, or for the motor to be heard of."""

    until: float
    tokens: list[Any]
    failure: Alarm
    error: str


class Motions(View):
    def __init__(self, name: str, is_axis: bool = False) -> None:
        super().__init__(name, is_axis)
        self.jobs: dict[int, Job] = {}  # asked for, by number
        self.waiting: Job | None = None  # until SPMG is Go
        self.settling: Ending | None = None
        self.lost_motion: Ending | None = None
        self.external = False
        self._left: Alarm = alarms.NONE  # told at the end of what is shown as external: a motion of this record went on in it
        self.pausing = False  # the daemon has not answered yet
        self._late_until: float | None = None

    @property
    def in_motion(self) -> bool:
        return bool(self.jobs or self.waiting or self.settling or self.lost_motion or self.external)

    @property
    def job(self) -> Job | None:
        """The newest one."""
        return self.waiting or (self.jobs[max(self.jobs)] if self.jobs else None)

    # -- what the layer above begins

    def fall(self) -> None:
        if self.values["DMOV"] == 1:
            self.post("DMOV", 0)

    def begin(self, job: Job, now: float) -> None:
        """DMOV has fallen."""
        self._supersede()
        if not self.jobs:
            self._clear_failure()
        if job.target is not None:
            self.show_direction(job.target)
            self.show_target(job.target)
            self.post("LVIO", 0)
        self.post("MIP", job.mip)
        self.show_status()
        if (self.values["SPMG"] == PAUSE or self.pausing) and job.kind == "move":
            self.waiting = job
        else:
            self.issue(job)

    def issue(self, job: Job) -> None:
        """The next leg."""
        number = job.number = self.next_number()
        self.jobs[number] = job
        job.accepted = False
        if job.kind == "home":
            self.ask(events.Home(number, job.who, job.speed))
        elif job.kind == "jog":
            self.ask(events.Jog(number, job.who, job.speed or 0.0))
        else:
            to, speed = job.legs.pop(0)
            self.ask(events.Move(number, job.who, to, speed))

    def refuse(self, token: Any, reason: str, now: float) -> None:
        """A motion that is not asked for. DMOV has fallen: where nothing moves it rises, with an alarm, as after any move that fails."""
        self._ended_badly([token], Alarm(Status.STATE, Severity.MAJOR, reason), reason, now)

    def drop_deferred(self, why: str, now: float, circuit: Any = None) -> None:
        """Targets that wait for others to begin with; `circuit`: those of this client only."""
        for job in list(self.jobs.values()):
            if job.deferred and circuit in (None, job.circuit):
                del self.jobs[job.number]
                self._ended_badly(job.tokens, Alarm(Status.STATE, Severity.MAJOR, why), why, now)

    def halt(self, who: Any, now: float) -> int | None:
        """STOP: the number of what is asked for. Of a motor at rest nothing."""
        self.drop_deferred("stopped before the deferred moves began", now)
        self._end_settling_now(now)
        if self.waiting is not None:
            job, self.waiting = self.waiting, None
            self._ended_badly(job.tokens, self._stopped(), "stopped before it had begun", now)
        if not (self.jobs or self.external or self.lost_motion):
            return None
        for job in self.jobs.values():
            job.stopping = True
        self.post("MIP", int(self.number("MIP")) | Mip.STOP)
        return self.ask(events.Stop(self.next_number(), who))

    # -- what the shell tells

    def accepted(self, number: int, now: float) -> None:
        job = self.jobs.get(number)
        if job is None:
            return
        job.accepted = True
        if job.kind == "jog":
            self.done(job.tokens)
        older = [other for other in self.jobs if other < number]
        for other in older:  # their results are still to come, and say nothing any more
            self.done(self.jobs.pop(other).tokens, SUPERSEDED)
        if older:
            self._clear_failure()

    def motion_refused(self, job: Job, reason: str, now: float) -> None:
        del self.jobs[job.number]
        failure = job.failure if job.failure is not alarms.NONE else Alarm(Status.STATE, Severity.MAJOR, reason)
        self._ended_badly(job.tokens, failure, reason, now)

    def motion_ended(self, job: Job, outcome: str, reason: str, now: float) -> None:
        """The positions that belong to it were told before, by `observe`."""
        del self.jobs[job.number]
        if self.jobs:  # a newer one goes on
            reached = outcome == End.REACHED and not job.legs
            self.done(job.tokens, "" if reached else SUPERSEDED)
            return
        if outcome == End.LINK:
            return self._wait_for_link(job.tokens, reason, now)
        if outcome == End.REACHED and job.legs and not job.stopping:
            self.post("MIP", job.mip | Mip.MOVE_BL)
            if self.values["SPMG"] == PAUSE:
                self.waiting = job
                return
            return self.issue(job)
        if outcome == End.REACHED and job.legs:  # the end of its first leg: it was stopped there
            outcome, reason = End.STOPPED, self._stopped().reason
        if outcome == End.REACHED and not job.legs:
            return self._conclude(job.tokens, job.failure, job.failure.reason, now)
        if job.kind == "jog" and outcome in (End.STOPPED, End.REACHED):
            return self._conclude(job.tokens, alarms.NONE, "", now)
        if self._makes_up(job, outcome, reason):
            return
        self.slipped = outcome == End.FAULT
        status = Status.HWLIMIT if outcome == End.LIMIT else Status.STATE
        failure = job.failure if job.failure is not alarms.NONE else Alarm(status, Severity.MAJOR, reason)
        self._conclude(job.tokens, failure, reason or outcome, now)

    def motion_lost(self, job: Job, reason: str, now: float) -> None:
        """What becomes of it nobody will know."""
        del self.jobs[job.number]
        if self.jobs:
            self.done(job.tokens, reason)
        else:
            self._wait_for_link(job.tokens, reason, now)

    def follow(self, now: float) -> None:
        """After a state was seen: motions that others began, and ones whose end was not heard."""
        moves = self.seen.live and (self.seen.moving or self.seen.busy)
        rests = self.seen.live and self.seen.user is not None and not moves
        if self.lost_motion is not None:
            if rests and not self.silent:
                self._end_lost()
            elif moves and not self.silent:
                self._become_external(self.lost_motion)
            return
        if self.jobs or self.waiting or self.settling:
            return
        if moves and not self.external:
            self.external = True
            self.fall()
            self._clear_failure()
            self.post("MIP", Mip.EXTERNAL)
        elif self.external and rests:
            self.external = False
            self._finish([], self._left, self._left.reason)
        elif self.external and not self.seen.live:
            self.external = False
            self._wait_for_link([], "its MCU is offline", now)
        elif rests:
            self._follow_target()

    def expect_late(self, now: float) -> None:
        """It has come to rest, as somebody else has told who may be faster than its states."""
        self._late_until = now + LATE_STATE_S

    def is_late(self, moves: bool, now: float) -> bool:
        """A state from before the end of the last motion: it is not to be shown."""
        if self._late_until is None:
            return False
        if not moves or now >= self._late_until:
            self._late_until = None
            return False
        return True

    @property
    def has_late_state(self) -> bool:
        """A state that has been told is to be told again: it was not shown."""
        return self._late_until is not None

    def motion_deadline(self) -> float | None:
        times = [ending.until for ending in (self.settling, self.lost_motion) if ending is not None]
        return min(times, default=None)

    def motion_tick(self, now: float) -> None:
        if self.settling is not None and now >= self.settling.until:
            self._end_settling_now(now)
        if self.lost_motion is not None and now >= self.lost_motion.until:
            if self._is_seen_moving():
                self._become_external(self.lost_motion)
            else:
                self._end_lost()

    # -- ends

    def _supersede(self) -> None:
        if self.settling is not None:
            ending, self.settling = self.settling, None
            self.done(ending.tokens, ending.error)
        if self.lost_motion is not None:
            ending, self.lost_motion = self.lost_motion, None
            self.done(ending.tokens, ending.error)
        if self.waiting is not None:
            job, self.waiting = self.waiting, None
            self.done(job.tokens, SUPERSEDED)
        self.external = False
        self._left = alarms.NONE

    def _is_seen_moving(self) -> bool:
        return not self.silent and self.seen.live and (self.seen.moving or self.seen.busy)

    def _become_external(self, ending: Ending) -> None:
        """It is over for who has asked for it, and the motor moves: DMOV rises when it is at rest."""
        self.settling = self.lost_motion = None
        self.external, self._left = True, ending.failure
        self.post("MIP", Mip.EXTERNAL)
        self.done(ending.tokens, ending.error)

    def _clear_failure(self) -> None:
        self.failure = alarms.NONE
        self.slipped = False
        self.raise_alarm(self._alarm_now())

    @staticmethod
    def _stopped() -> Alarm:
        return Alarm(Status.STATE, Severity.MAJOR, "stopped before its target")

    def _makes_up(self, job: Job, outcome: str, reason: str) -> bool:
        """After a STOP that this record has asked for: the load lies at the wrong flank if it went against the backlash."""
        if self.values["SPMG"] in (STOP, PAUSE):
            return False
        backlash, here = self.number("BDST"), self.seen.dial
        if not (job.kind == "move" and job.stopping and outcome == End.STOPPED) or here is None:
            return False
        if job.failure is not alarms.NONE or not backlash or bool(self.number("CDIR")) == (backlash > 0):
            return False
        scale = self.seen.scale
        before, at = scale.user(here - backlash), scale.user(here)
        if not self.within_limits(before):
            return False
        again = Job("move", job.tokens, job.who, job.circuit, Mip.MOVE_BL, at)
        again.failure = Alarm(Status.STATE, Severity.MAJOR, reason or "stopped before its target")
        again.legs = [(before, self.floor("VELO")), (at, self.floor("BVEL"))]
        self.show_target(at)
        self.post("MIP", Mip.MOVE_BL)
        self.issue(again)
        return True

    def within_limits(self, user: float) -> bool:
        """Half a step beyond them is at them."""
        seen = self.seen
        if seen.low is None or seen.high is None:
            return True
        slack = abs(seen.scale.resolution) / 2
        return seen.low - slack <= user <= seen.high + slack

    def _wait_for_link(self, tokens: list[Any], reason: str, now: float) -> None:
        failure = Alarm(Status.COMM, Severity.MAJOR, reason)
        self.done(tokens, reason)
        self.lost_motion = Ending(now + LOST_S + 2 * self.number("ACCL"), [], failure, reason)

    def _ended_badly(self, tokens: list[Any], failure: Alarm, error: str, now: float) -> None:
        """Before it began."""
        job = self.job
        self.external = self.external or (job is None and self.seen.live and (self.seen.moving or self.seen.busy))
        if not self.in_motion:
            self._finish(tokens, failure, error)
            return
        if job is None:
            self.place_target()
        elif job.target is not None:
            self.show_target(job.target)
        self.done(tokens, error)

    def _conclude(self, tokens: list[Any], failure: Alarm, error: str, now: float) -> None:
        delay_s = self.number("DLY")
        if delay_s > 0:
            self.post("MIP", Mip.DELAY)
            self.settling = Ending(now + delay_s, list(tokens), failure, error)
        else:
            self._finish(tokens, failure, error, now)

    def _end_settling_now(self, now: float) -> None:
        if self.settling is not None:
            ending, self.settling = self.settling, None
            if self._is_seen_moving():  # another client's move has begun meanwhile
                return self._become_external(ending)
            self._finish(ending.tokens, ending.failure, ending.error, now)

    def _end_lost(self) -> None:
        assert self.lost_motion is not None
        ending, self.lost_motion = self.lost_motion, None
        self._finish(ending.tokens, ending.failure, ending.error)

    def _finish(self, tokens: list[Any], failure: Alarm, error: str, now: float | None = None) -> None:
        """The only place where DMOV rises."""
        self.failure, self._left = failure, alarms.NONE
        if failure.severity is not Severity.NO_ALARM:
            self.place_target()
        self._follow_target()
        self.post_all({"MOVN": 0, "MIP": 0, "JOGF": 0, "JOGR": 0, "HOMF": 0, "HOMR": 0})
        if now is not None:
            self.expect_late(now)
        self.show()
        self.post("MOVN", 0)
        self.post("DMOV", 1)
        self.show_status()
        if self.values["SPMG"] == MOVE_ONCE:
            self.post("SPMG", PAUSE)
        self.done(tokens, error)

    def _follow_target(self) -> None:
        """At rest: somebody has set where it stands, or its offset."""
        if self.seen.user is not None and not abs(self.number("VAL") - self.seen.user) <= abs(self.seen.scale.resolution):
            self.place_target()
