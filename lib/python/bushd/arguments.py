"""What both faces make of their callers' arguments, and of the daemon's answers."""

from __future__ import annotations

import dataclasses
import os
import re
import secrets
import socket
import sys
from collections.abc import Mapping
from typing import Any

from . import model
from .errors import MoveFailed, RequestFailed, UnknownMotor
from .requests import STEPS
from .session import Exchange

MAX_CLIENT_ID = 64

Amount = float | Mapping[str, float]


def client_id(program: str | None) -> str:
    """PROGRAM@HOST-PID-RANDOM, as the log of moves reads it. Unique among running clients: process numbers repeat, and containers may share a host's name."""
    name = program or os.path.basename(sys.argv[0] if sys.argv else "") or "python"
    name = name.lstrip("-") or "python"  # of python -c
    tail = f"-{os.getpid()}-{secrets.token_hex(4)}"
    head = re.sub(r"[^!-~]", "_", f"{name.replace('@', '_')}@{socket.gethostname()}")
    return head[: MAX_CLIENT_ID - len(tail)] + tail


@dataclasses.dataclass(frozen=True)
class Amounts:
    """Motors and how far, or where to."""

    values: Mapping[str, float]
    absolute: bool
    unit: str | None

    @property
    def in_steps(self) -> bool:
        return self.unit == STEPS

    @property
    def how(self) -> dict[str, Any]:
        """As arguments of requests."""
        return {"amounts": self.values, "absolute": self.absolute, "in_steps": self.in_steps}


def amounts(
    motors: str | Mapping[str, float] | None, to: Amount | None, by: Amount | None, unit: str | None
) -> Amounts:
    """The arguments of `move()`: ("theta", to=4), ({"theta": 4}), (by={"theta": 4}) and so on."""
    if isinstance(motors, Mapping):
        if to is not None or by is not None:
            raise TypeError("positions are given twice: write move({...}), move(to={...}) or move(by={...})")
        return Amounts(dict(motors), True, unit)
    if (to is None) == (by is None):
        raise TypeError("write one of to=POSITION and by=DISTANCE")
    value = to if to is not None else by
    if isinstance(value, Mapping) != (motors is None):
        raise TypeError('write move("NAME", to=POSITION) or move(to={"NAME": POSITION}), or the same with by=')
    if isinstance(value, Mapping):
        return Amounts(dict(value), to is not None, unit)
    assert value is not None and motors is not None
    return Amounts({motors: value}, to is not None, unit)


def check_unit(wanted: Amounts, status: model.Status) -> None:
    """Raises ValueError where a motor has another unit than the one that is written."""
    for name in wanted.values:
        motor = find(status, name)
        if motor.unit != wanted.unit:
            raise ValueError(f'{name}: its unit is "{motor.unit}", not "{wanted.unit}"')


def find(status: model.Status, name: str) -> model.Motor:
    motor = status.motors.get(name)
    if motor is None:
        raise UnknownMotor(f'no motor "{name}"; there are: {", ".join(sorted(status.motors))}')
    return motor


def result_of(exchange: Exchange, check: bool) -> model.Result:
    """The result of an exchange that is over. Raises its error, and RequestFailed where it has not succeeded (with `check`)."""
    if exchange.error is not None:
        raise exchange.error
    assert exchange.outcome is not None
    result = model.Result(exchange.outcome, exchange.reason)
    if check and not result.outcome.succeeded:
        raise RequestFailed(result)
    return result


def move_result_of(exchange: Exchange, check: bool) -> model.MoveResult:
    """The result of a motion; raises MoveFailed."""
    plain = result_of(exchange, check=False)
    result = model.MoveResult(plain.outcome, plain.reason, exchange.detail.motors)
    if check and not result.outcome.succeeded:
        raise MoveFailed(result)
    return result
