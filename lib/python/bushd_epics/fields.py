"""Which fields a motor record has: their types, what they are before the daemon has told anything, and who may put them.

Those of ophyd's EpicsMotor, ophyd-async's Motor, pyepics' Motor and the screens motorx_all.bob and motorx_setup.bob of the motor
module, with the types and words that the motor record (R7) has.
"""

from __future__ import annotations

import dataclasses
import enum
import math

from . import alarms


class Kind(enum.Enum):
    DOUBLE = "double"
    LONG = "long"
    SHORT = "short"
    ENUM = "enum"
    STRING = "string"
    WAVEFORM = "waveform"  # numbers, of profiles
    CHARS = "chars"  # a longer text, of profiles


Value = float | int | str


@dataclasses.dataclass(frozen=True)
class Field:
    kind: Kind
    initial: Value = 0
    words: tuple[str, ...] = ()  # of an enum; its value is the number of the word
    settable: bool = False
    why_not: str = ""  # said to who puts one that is not settable
    is_position: bool = False  # in the unit of the motor, with its decimals


_COMPUTED = "it is what the motor does, and cannot be put"
_TABLE = "the acceleration table of the motor's group says it: bushctl tables"
_NO_ENCODER = "the motor has no encoder: its MCU counts every step"
_MECHANICS = "steps_per_unit in bushd.toml says it"
_RECORD = "bushd-epics has no database that this could be of use in"

_NO_YES = ("No", "Yes")


def _computed(kind: Kind, initial: Value = 0, words: tuple[str, ...] = (), position: bool = False) -> Field:
    return Field(kind, initial, words, why_not=_COMPUTED, is_position=position)


def _fixed(kind: Kind, initial: Value, why_not: str, words: tuple[str, ...] = (), position: bool = False) -> Field:
    return Field(kind, initial, words, why_not=why_not, is_position=position)


def _put(kind: Kind, initial: Value = 0, words: tuple[str, ...] = (), position: bool = False) -> Field:
    return Field(kind, initial, words, settable=True, is_position=position)


_D, _L, _S, _E, _T = Kind.DOUBLE, Kind.LONG, Kind.SHORT, Kind.ENUM, Kind.STRING

FIELDS: dict[str, Field] = {
    # Where to.
    "VAL": _put(_D, math.nan, position=True),
    "DVAL": _put(_D, math.nan, position=True),
    "RVAL": _put(_L),
    "RLV": _put(_D, 0.0, position=True),
    "TWV": _put(_D, 1.0, position=True),
    "TWF": _put(_S),
    "TWR": _put(_S),
    # Where it is.
    "RBV": _computed(_D, math.nan, position=True),
    "DRBV": _computed(_D, math.nan, position=True),
    "RRBV": _computed(_L),
    "RMP": _computed(_L),
    "REP": _computed(_L),
    "DIFF": _computed(_D, 0.0, position=True),
    "RDIF": _computed(_L),
    # What it does.
    "DMOV": _computed(_S, 1),
    "MOVN": _computed(_S),
    "TDIR": _computed(_S),
    "CDIR": _computed(_S),
    "MIP": _computed(_L),
    "MSTA": _computed(_L, 2),
    "HLS": _computed(_S),
    "LLS": _computed(_S),
    "RHLS": _computed(_S),
    "RLLS": _computed(_S),
    "ATHM": _computed(_S),
    "LVIO": _computed(_S),
    "RVEL": _computed(_L),
    "RCNT": _computed(_S),
    "MISS": _computed(_S),
    "PP": _computed(_S),
    # What makes it move, and stop.
    "STOP": _put(_S),
    "SPMG": _put(_E, 3, ("Stop", "Pause", "Move", "Go")),
    "JOGF": _put(_S),
    "JOGR": _put(_S),
    "HOMF": _put(_S),
    "HOMR": _put(_S),
    "SYNC": _put(_S),
    "STUP": _put(_E, 0, ("OFF", "ON", "BUSY")),
    "CNEN": _put(_E, 0, ("Disable", "Enable")),
    # Speeds.
    "VELO": _put(_D, 1.0, position=True),
    "VMAX": _fixed(_D, 1.0, _TABLE, position=True),
    "VBAS": _fixed(_D, 0.0, _TABLE, position=True),
    "ACCL": _fixed(_D, 0.0, _TABLE),
    "BVEL": _put(_D, 1.0, position=True),
    "BACC": _fixed(_D, 0.0, _TABLE),
    "JVEL": _put(_D, 1.0, position=True),
    "JAR": _fixed(_D, 0.0, _TABLE),
    "HVEL": _put(_D, 1.0, position=True),
    "S": _computed(_D, 0.0),
    "SMAX": _fixed(_D, 0.0, _TABLE),
    "SBAS": _fixed(_D, 0.0, _TABLE),
    "SBAK": _fixed(_D, 0.0, _TABLE),
    "BDST": _put(_D, 0.0, position=True),
    "DLY": _put(_D, 0.0),
    "FRAC": _fixed(_D, 1.0, "every move goes all of its way"),
    # Scales and limits.
    "OFF": _put(_D, 0.0, position=True),
    "DIR": _put(_E, 0, ("Pos", "Neg")),
    "FOFF": _put(_E, 0, ("Variable", "Frozen")),
    "SET": _put(_E, 0, ("Use", "Set")),
    "SUSE": _put(_S),
    "SSET": _put(_S),
    "VOF": _put(_S),
    "FOF": _put(_S),
    "HLM": _put(_D, 0.0, position=True),
    "LLM": _put(_D, 0.0, position=True),
    "DHLM": _put(_D, 0.0, position=True),
    "DLLM": _put(_D, 0.0, position=True),
    "MRES": _fixed(_D, 1.0, _MECHANICS),
    "ERES": _fixed(_D, 1.0, _NO_ENCODER),
    "RRES": _fixed(_D, 1.0, _NO_ENCODER),
    "UREV": _fixed(_D, 200.0, _MECHANICS),
    "SREV": _fixed(_L, 200, _MECHANICS),
    "UEIP": _fixed(_E, 0, _NO_ENCODER, _NO_YES),
    "URIP": _fixed(_E, 0, _NO_ENCODER, _NO_YES),
    "RDBD": _fixed(_D, 1.0, _NO_ENCODER, position=True),
    "SPDB": _fixed(_D, 0.0, _NO_ENCODER, position=True),
    "RTRY": _fixed(_S, 0, _NO_ENCODER),
    "RMOD": _fixed(_E, 0, _NO_ENCODER, ("Default", "Arithmetic", "Geometric", "In-Position")),
    "NTM": _fixed(_E, 1, "a new target counts at once", ("NO", "YES")),
    "NTMF": _fixed(_S, 2, "a new target counts at once"),
    "PCOF": _fixed(_D, 0.0, "a stepper has no such loop"),
    "ICOF": _fixed(_D, 0.0, "a stepper has no such loop"),
    "DCOF": _fixed(_D, 0.0, "a stepper has no such loop"),
    # What it was before the last put.
    "LVAL": _computed(_D, math.nan, position=True),
    "LDVL": _computed(_D, math.nan, position=True),
    "LRVL": _computed(_L),
    "LRLV": _computed(_D, 0.0, position=True),
    "LSPG": _computed(_E, 3, ("Stop", "Pause", "Move", "Go")),
    # What all records have.
    "NAME": _fixed(_T, "", "names.toml says it"),
    "DESC": _fixed(_T, "", "description in bushd.toml says it"),
    "EGU": _fixed(_T, "", "unit in bushd.toml says it"),
    "PREC": _fixed(_S, 0, "precision in bushd.toml says it"),
    "RTYP": _fixed(_T, "motor", _RECORD),
    "DTYP": _fixed(_T, "bushd", _RECORD),
    "VERS": _fixed(_D, 7.4, _RECORD),
    "CARD": _fixed(_S, 0, _RECORD),
    "OUT": _fixed(_T, "", _RECORD),
    "RDBL": _fixed(_T, "", _RECORD),
    "RLNK": _fixed(_T, "", _RECORD),
    "STOO": _fixed(_T, "", _RECORD),
    "DOL": _fixed(_T, "", _RECORD),
    "DINP": _fixed(_T, "", _RECORD),
    "FLNK": _fixed(_T, "", _RECORD),
    "SDIS": _fixed(_T, "", _RECORD),
    "PREM": _fixed(_T, "", _RECORD),
    "POST": _fixed(_T, "", _RECORD),
    "OMSL": _fixed(_E, 0, _RECORD, ("supervisory", "closed_loop")),
    "SCAN": _fixed(_E, 0, _RECORD, ("Passive", "Event", "I/O Intr", "10 second", "5 second", "2 second", "1 second", ".5 second")),
    "PINI": _fixed(_E, 0, _RECORD, ("NO", "YES")),
    "DISP": _fixed(_S, 0, _RECORD),
    "DISA": _fixed(_S, 0, _RECORD),
    "DISV": _fixed(_S, 1, _RECORD),
    "PACT": _computed(_S),
    "PROC": _put(_S),
    "UDF": _computed(_S, 1),
    "STAT": _computed(_T, alarms.Status.COMM.name),  # an enum of Channel Access has 16 words, and UDF is the 18th
    "SEVR": _computed(_E, int(alarms.Severity.INVALID), alarms.SEVERITY_WORDS),
    "AMSG": _computed(_T, ""),
    "HIHI": _fixed(_D, 0.0, _RECORD, position=True),
    "HIGH": _fixed(_D, 0.0, _RECORD, position=True),
    "LOW": _fixed(_D, 0.0, _RECORD, position=True),
    "LOLO": _fixed(_D, 0.0, _RECORD, position=True),
    "HHSV": _fixed(_E, 0, _RECORD, alarms.SEVERITY_WORDS),
    "HSV": _fixed(_E, 0, _RECORD, alarms.SEVERITY_WORDS),
    "LSV": _fixed(_E, 0, _RECORD, alarms.SEVERITY_WORDS),
    "LLSV": _fixed(_E, 0, _RECORD, alarms.SEVERITY_WORDS),
    "HLSV": _fixed(_E, 2, _RECORD, alarms.SEVERITY_WORDS),
    "HOPR": _fixed(_D, 0.0, "it is the high soft limit", position=True),
    "LOPR": _fixed(_D, 0.0, "it is the low soft limit", position=True),
}
