"""A record on the bench: no EPICS, no daemon, and a clock that the test winds."""

import dataclasses
import math

from bushd_epics import events
from bushd_epics.events import Seen, Speeds
from bushd_epics.record import Putter, Record
from bushd_epics.scale import Scale

REST = Seen(
    user=0.0, dial=0.0, steps=0, target_steps=0, target=0.0, enabled=True, scale=Scale(0.01), low=-50.0, high=50.0, unit="deg", precision=3
)


class Bench:
    def __init__(self, **seen):
        self.now = 100.0
        self.record = Record("LAB:theta", set_times_out_s=30.0)
        self.said = []  # all that came out since `hear`
        self.answers = {}  # of puts, by their token
        self._tokens = 0
        self.see(**seen)
        self.record.speeds(Speeds(top=25.0, least=1.0, ramp_s=0.2))
        self._collect()
        self.hear()

    # -- what happens to it

    def see(self, **changes):
        """The daemon tells where the motor is; what is not named is as at rest at 0."""
        self.record.observe(dataclasses.replace(REST, **changes), self.now)
        self._collect()

    def at(self, user, **changes):
        """As `see`, at this position."""
        scale = changes.get("scale", REST.scale)
        dial = scale.dial(user)
        self.see(user=user, dial=dial, steps=scale.steps(dial), target=user, **changes)

    def put(self, field, value, circuit="circuit"):
        """The token of the put."""
        self._tokens += 1
        self.record.put(field, value, Putter(who="me:pc", circuit=circuit, token=self._tokens), self.now)
        self._collect()
        return self._tokens

    def accept(self, ask):
        self.record.accepted(ask.number, self.now)
        self._collect()

    def end(self, ask, outcome, reason=""):
        self.record.ended(ask.number, outcome, reason, self.now)
        self._collect()

    def refuse(self, ask, reason):
        self.record.refused(ask.number, reason, self.now)
        self._collect()

    def lose(self, ask, reason):
        self.record.lost(ask.number, reason, self.now)
        self._collect()

    def silent(self, why):
        self.record.fall_silent(why, self.now)
        self._collect()

    def gone(self, circuit):
        self.record.client_gone(circuit, self.now)
        self._collect()

    def wait(self, seconds):
        """The clock goes on, and what is due is done."""
        end = self.now + seconds
        while (at := self.record.wake_at()) is not None and at <= end:
            self.now = max(self.now, at)
            self.record.tick(self.now)
            self._collect()
        self.now = end

    # -- what it says

    def hear(self):
        said, self.said = self.said, []
        return said

    def asks(self):
        """What the daemon is asked for since the last look; the rest stays."""
        asked = [event for event in self.said if isinstance(event, events.Ask)]
        self.said = [event for event in self.said if not isinstance(event, events.Ask)]
        return asked

    def ask(self, kind):
        """The one thing that is asked for, of this kind."""
        asked = self.asks()
        assert len(asked) == 1 and isinstance(asked[0], kind), asked
        return asked[0]

    def values(self, field):
        """What was posted of a field since `hear`."""
        return [event.value for event in self.said if isinstance(event, events.Post) and event.field == field]

    def order(self, *fields):
        """The posts of these fields and the answers of puts, in order."""
        told = []
        for event in self.said:
            if isinstance(event, events.Post) and event.field in fields:
                told.append((event.field, event.value))
            elif isinstance(event, events.Done):
                told.append("answer")
            elif isinstance(event, events.Raise):
                told.append(("alarm", event.alarm.severity.name))
        return told

    def __getitem__(self, field):
        return self.record.values[field]

    @property
    def severity(self):
        return self.record.alarm.severity.name

    def _collect(self):
        for event in self.record.take():
            self.said.append(event)
            if isinstance(event, events.Done):
                assert event.token not in self.answers, "a put is answered twice"
                self.answers[event.token] = event.error


def is_nan(value):
    return isinstance(value, float) and math.isnan(value)
