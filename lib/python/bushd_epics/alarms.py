"""Status and severity of alarms, with the numbers and words that EPICS has for them (menuAlarmStat, menuAlarmSevr)."""

from __future__ import annotations

import dataclasses
import enum


class Severity(enum.IntEnum):
    NO_ALARM = 0
    MINOR = 1
    MAJOR = 2
    INVALID = 3


class Status(enum.IntEnum):
    NO_ALARM = 0
    STATE = 7
    COMM = 9
    HWLIMIT = 11
    UDF = 17


SEVERITY_WORDS = ("NO_ALARM", "MINOR", "MAJOR", "INVALID")


@dataclasses.dataclass(frozen=True)
class Alarm:
    status: Status
    severity: Severity
    reason: str = ""  # for people, in the field AMSG


NONE = Alarm(Status.NO_ALARM, Severity.NO_ALARM)
