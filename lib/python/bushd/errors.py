"""What can go wrong, as exceptions. All of them derive from `BushdError`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .model import MoveResult, Result


class BushdError(Exception):
    """Base of all errors of this package."""


class NoDaemon(BushdError):
    """No daemon can be reached, or it has not answered in time.

    Where the request may be carried out nevertheless, the text says so.
    """


class ResultUnknown(BushdError):
    """The daemon has accepted the request, and what became of it cannot be known any more.

    The daemon has ended, restarted, or fallen silent. Look at the state (`where()`) and decide.
    """


class TwoDaemons(BushdError):
    """Two daemons answer on the same LCM channels, so nothing but stops is sent."""


class Refused(BushdError):
    """The daemon refuses the request; nothing has moved or changed.

    `reason` says what was refused, why with the figure, and what to do.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.reason = reason


class UnknownMotor(BushdError, LookupError):
    """No motor of this name is in the daemon's configuration."""


class RequestFailed(BushdError):
    """The request was carried out and has not succeeded; `result` says how it has ended."""

    result: Result

    def __init__(self, result: Result) -> None:
        super().__init__(f"{result.outcome.value}: {result.reason}")
        self.result = result


class MoveFailed(RequestFailed):
    """A motion has ended otherwise than asked for; `result` says, per motor, how and where."""

    result: MoveResult
