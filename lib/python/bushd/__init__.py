"""A client of bushd, the daemon that moves stepper motors:

    import bushd

    with bushd.connect() as client:
        client.move("theta", to=12.5)
        print(client.where("theta").position)

`bushd.aio` is the same for asyncio. Everything is Python; nothing but the standard library is needed.
"""

from . import aio
from .client import Client, Jog, Motion, Tables, connect
from .envelopes import Envelope
from .errors import (
    BushdError,
    MoveFailed,
    NoDaemon,
    Refused,
    RequestFailed,
    ResultUnknown,
    TwoDaemons,
    UnknownMotor,
)
from .model import (
    Activity,
    BusHealth,
    CamacResponse,
    CamacResult,
    Configuration,
    Inhibited,
    Mcu,
    McuHealth,
    McuState,
    Motor,
    MotorResult,
    LineState,
    MovePlan,
    MoveResult,
    Outcome,
    PastMotion,
    PlannedLeg,
    Program,
    ProgramMotor,
    ProgramStage,
    Result,
    Setting,
    Status,
    Table,
    TableEntry,
    TableRef,
    Trust,
)
from .session import Timing
from .version import __version__

__all__ = [
    "Activity",
    "BusHealth",
    "BushdError",
    "CamacResponse",
    "CamacResult",
    "Client",
    "Configuration",
    "Envelope",
    "Inhibited",
    "Jog",
    "Mcu",
    "McuHealth",
    "McuState",
    "Motion",
    "Motor",
    "MotorResult",
    "MoveFailed",
    "LineState",
    "MovePlan",
    "MoveResult",
    "NoDaemon",
    "Outcome",
    "PastMotion",
    "PlannedLeg",
    "Program",
    "ProgramMotor",
    "ProgramStage",
    "Refused",
    "RequestFailed",
    "Result",
    "ResultUnknown",
    "Setting",
    "Status",
    "Table",
    "TableEntry",
    "TableRef",
    "Tables",
    "Timing",
    "Trust",
    "TwoDaemons",
    "UnknownMotor",
    "__version__",
    "aio",
    "connect",
]
