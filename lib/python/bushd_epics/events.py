"""What goes into a record, and what comes out of it, besides puts."""

from __future__ import annotations

import dataclasses
from typing import Any

from .alarms import Alarm
from .fields import Value
from .scale import Scale


@dataclasses.dataclass(frozen=True)
class Speeds:
    """How fast the motor can go, in units a second, by its table and its settings."""

    top: float
    least: float  # the first step from rest
    ramp_s: float  # from rest to `top`


@dataclasses.dataclass(frozen=True)
class Seen:
    """A motor as the daemon has told it. Positions are None while nobody knows them."""

    user: float | None = None
    dial: float | None = None
    steps: int | None = None
    target_steps: int | None = None
    target: float | None = None
    moving: bool = False
    busy: bool = False  # a motion is open, though the motor may stand at the moment
    armed: bool = False  # it waits for an edge at the trigger input, as its MCU has confirmed
    live: bool = True  # its MCU tells where it is
    uncertain: str = ""  # why the position is not to be trusted; "": it is
    steps_per_s: float = 0.0
    enabled: bool = False
    held: bool = False
    plus_limit: bool = False  # inhibits the positive direction, on the dial
    minus_limit: bool = False
    at_home: bool = False
    scale: Scale = Scale()
    low: float | None = None  # soft limits on the user's scale; None: it has none
    high: float | None = None
    unit: str = ""
    precision: int = 0
    description: str = ""
    place: str = ""  # where its driver is: "@hall:1 0"


# -- what is to be done


@dataclasses.dataclass(frozen=True)
class Post:
    field: str
    value: Value


@dataclasses.dataclass(frozen=True)
class Raise:
    """The alarm of all fields from now on."""

    alarm: Alarm


@dataclasses.dataclass(frozen=True)
class Done:
    """A put is answered: `error` says why it has failed."""

    token: Any
    error: str = ""


@dataclasses.dataclass(frozen=True)
class Log:
    text: str


@dataclasses.dataclass(frozen=True)
class Ask:
    """Something asked of the daemon; answered by `accepted`, `refused`, `ended` or `lost` of the record, with its number."""

    number: int
    who: Any  # who has asked for it, as the shell knows people


@dataclasses.dataclass(frozen=True)
class Move(Ask):
    to: float
    speed: float | None  # None: as fast as the table allows


@dataclasses.dataclass(frozen=True)
class Home(Ask):
    speed: float | None


@dataclasses.dataclass(frozen=True)
class Jog(Ask):
    speed: float  # signed, on the user's scale


@dataclasses.dataclass(frozen=True)
class EndJog(Ask):
    jog: int  # the number of what is to end


@dataclasses.dataclass(frozen=True)
class Stop(Ask):
    pass


@dataclasses.dataclass(frozen=True)
class Pause(Ask):
    pass


@dataclasses.dataclass(frozen=True)
class Resume(Ask):
    pass


@dataclasses.dataclass(frozen=True)
class SetPosition(Ask):
    to: float
    dial: bool


@dataclasses.dataclass(frozen=True)
class Configure(Ask):
    changes: tuple[tuple[str, Any], ...]


@dataclasses.dataclass(frozen=True)
class Enable(Ask):
    on: bool


@dataclasses.dataclass(frozen=True)
class Hold(Ask):
    on: bool


class End:
    """How an ask has ended, as `ended` of the record is told."""

    REACHED = "reached"
    STOPPED = "stopped"
    LIMIT = "limit"
    LINK = "link"
    FAULT = "fault"
