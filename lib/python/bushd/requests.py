"""What can be asked of the daemon, as requests of `session`: any message by `ask()`, and by functions what takes more than that.

Names of motors and numbers go as they come; the daemon resolves them, checks every range, and refuses with a reason.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from . import messages, model
from .messages import finite
from .session import Request

STEPS = "steps"

Amounts = Mapping[str, float]
Names = Iterable[str]
Rows = Iterable[Iterable[float]]
Fields = dict[str, Any]
# (N, A, F), and of functions that write (N, A, F, data).
Cycle = tuple[int, int, int] | tuple[int, int, int, int]

# What one message holds (move_path_t, follow_t); more come in several.
MOST_VALUES = 4096


def ask(channel: str, *, repeatable: bool = False, **fields: Any) -> Request:
    """The message of this channel. Raises TypeError and ValueError for what its fields cannot say."""
    kind = getattr(messages, "camac_request_t" if channel == "CAMAC" else f"{channel.lower()}_t")
    return Request(channel, kind(**fields), repeatable)


def move_path(
    motors: Names,
    points: Rows,
    *,
    exact: bool = False,
    in_steps: bool = False,
    speed: float | None = None,
    speeds: Iterable[float] = (),
    feed: float | None = None,
    dry_run: bool = False,
) -> list[Request]:
    """The last of them begins the motion; those before it carry points only."""
    names, rows, limits = list(motors), [list(point) for point in points], list(speeds)
    if limits and len(limits) != len(rows):
        raise ValueError(f"{len(limits)} speeds for {len(rows)} points")
    corners = "EXACT" if exact else "CONTINUOUS"
    how: Fields = {"motors": named(names), "corners": corners, "dry_run": dry_run, **with_speed(speed, in_steps)}
    how |= with_feed(feed, in_steps)
    return [
        ask(
            "MOVE_PATH",
            **how,
            rows=len(rows),
            first_row=first,
            positions=_in_a_row(some),
            speeds=limits[first : first + len(some)],
        )
        for first, some in _pieces(names, rows)
    ]


def follow(
    motors: Names, time_s: Iterable[float], positions: Rows, *, array: int, cubic: bool = False, stretch: float = 1.0
) -> list[Request]:
    """The last of them begins the motion; those before it carry rows only."""
    names, rows, times = list(motors), [list(row) for row in positions], list(time_s)
    if len(times) != len(rows):
        raise ValueError(f"{len(times)} times for {len(rows)} rows")
    how: Fields = {"motors": named(names), "array": array, "cubic": cubic, "stretch": stretch}

    def part(kind: str, first: int, some: list[list[float]]) -> Request:
        return ask("FOLLOW", **how, part=kind, time_s=times[first : first + len(some)], positions=_in_a_row(some))

    *pieces, last = _pieces(names, rows)
    return [*(part("ROWS", *piece) for piece in pieces), part("LAST_ROWS", *last), part("RUN", 0, [])]


def _pieces(names: list[str], rows: list[list[float]]) -> Iterator[tuple[int, list[list[float]]]]:
    """As many rows as a message holds, with the number of the first."""
    if not names or not rows:
        raise ValueError("no motor is named" if not names else "there is no row")
    for number, row in enumerate(rows, 1):
        if len(row) != len(names):
            raise ValueError(f"row {number} has {len(row)} positions for {len(names)} motors")
    most = max(1, MOST_VALUES // len(names))
    for first in range(0, len(rows), most):
        yield first, rows[first : first + most]


def _in_a_row(rows: list[list[float]]) -> list[float]:
    return [position for row in rows for position in row]


def jog(motor: str, speed: float, *, in_steps: bool, keepalive_ms: int, steps_after: int | None = None) -> Request:
    ends = -1 if steps_after is None else steps_after
    return ask("JOG", motor=motor, speed=speed, speed_in_steps=in_steps, keepalive_ms=keepalive_ms, steps_after=ends)


def renew_jog(motor: str, *, keepalive_ms: int) -> Request:
    return ask("JOG", motor=motor, keepalive_ms=keepalive_ms, steps_after=-1, renew=True)


def stop(names: Names) -> Request:
    return ask("STOP", motors=named(names), repeatable=True)


def change_configuration(motor: str, changes: Mapping[str, object]) -> Request:
    """Values: a number, a word, True or False, (low, high), a longer tuple of whole numbers and words, or None for none."""
    listed = [messages.motor_change_t(motor=motor, key=key, value=_setting(value)) for key, value in changes.items()]
    return ask("CONFIGURE", kind="CHANGE", changes=listed)


def put_program(name: str, program: str, points: Mapping[str, str], *, dry_run: bool = False) -> Request:
    files = [messages.program_points_t(file=file, text=text) for file, text in points.items()]
    return ask("PUT_PROGRAM", program=name, text=program, points=files, dry_run=dry_run)


_CAMAC_MODES = {"single": "SINGLE", "repeat": "REPEAT", "q-stop": "Q_STOP", "scan": "SCAN"}
_LAST_STATION, _LAST_SUBADDRESS = 23, 15


def camac(
    cycles: Iterable[Cycle], *, crate: int = 1, mode: str = "single", count: int | None = None, last: tuple[int, int] | None = None
) -> Request:
    if mode not in _CAMAC_MODES:
        raise ValueError(f"mode={mode!r}; allowed: {', '.join(_CAMAC_MODES)}")
    listed = [_camac_cycle(*cycle) for cycle in cycles]
    last_station, last_subaddress = last or (_LAST_STATION, _LAST_SUBADDRESS)
    return ask(
        "CAMAC",
        crate=crate,
        mode=_CAMAC_MODES[mode],
        count=len(listed) if count is None else count,
        last_station=last_station,
        last_subaddress=last_subaddress,
        cycles=listed,
    )


def _camac_cycle(*cycle: int) -> Any:
    if len(cycle) not in (3, 4):
        raise ValueError("a cycle is (N, A, F) or (N, A, F, data)")
    return messages.camac_cycle_t(**dict(zip(("station", "subaddress", "function", "data"), cycle)))


# -- fields of several messages


def way(amounts: Amounts, absolute: bool, in_steps: bool, speed: float | None = None) -> Fields:
    kind = "ABSOLUTE" if absolute else "RELATIVE"
    return {"motors": motor_amounts(amounts, in_steps), "kind": kind, **with_speed(speed, in_steps)}


def line(
    amounts: Amounts,
    absolute: bool,
    in_steps: bool,
    *,
    speed: float | None,
    duration_s: float | None,
    law: str,
    feed: float | None,
) -> Fields:
    how = {**way(amounts, absolute, in_steps, speed), **with_duration(duration_s), **with_feed(feed, in_steps)}
    return how if law == "leading" else {**how, **with_law(law)}


def motor_amounts(amounts: Amounts, in_steps: bool) -> list[Any]:
    if not amounts:
        raise ValueError("no motor is named")
    return [motor_amount(motor, value, in_steps) for motor, value in amounts.items()]


def motor_amount(motor: str, value: float, in_steps: bool) -> Any:
    how: Fields = {"steps": _whole(motor, value)} if in_steps else {"user": value}
    return messages.motor_amount_t(motor=motor, in_steps=in_steps, **how)


def _whole(motor: str, steps: float) -> int:
    """A number of steps may come as 400.0, from an array."""
    whole = steps if isinstance(steps, int) else int(finite(float(steps)))
    if whole != steps:
        raise ValueError(f"{motor}: {steps} is no whole number of steps")
    return whole


def with_speed(speed: float | None, in_steps: bool) -> Fields:
    if speed is None:
        return {}
    if finite(float(speed)) <= 0:
        raise ValueError(f"a speed of {speed:g}: it is to be above 0")
    return {"speed": speed, "speed_in_steps": in_steps}


def with_feed(feed: float | None, in_steps: bool) -> Fields:
    if feed is None:
        return {}
    if finite(float(feed)) <= 0:
        raise ValueError(f"a feed of {feed:g}: it is to be above 0")
    return {"feed": feed, "feed_in_steps": in_steps}


LAWS = {"leading": "LEADING", "elementary": "ELEMENTARY"}


def with_law(law: str) -> Fields:
    if law not in LAWS:
        raise ValueError(f'law "{law}": it is "leading" or "elementary"')
    return {"law": LAWS[law]}


def with_duration(duration_s: float | None) -> Fields:
    if duration_s is None:
        return {}
    # 0 on the bus of messages is "none".
    if not finite(float(duration_s)) > 0:
        raise ValueError(f"duration_s={duration_s}; allowed: above 0")
    return {"duration_s": duration_s}


def trigger(edge: str, delay_us: int, while_connected: bool) -> Fields:
    if edge not in ("rising", "falling"):
        raise ValueError(f'edge "{edge}": it is "rising" or "falling"')
    return {"edge": edge.upper(), "delay_us": delay_us, "while_connected": while_connected}


def named(names: Names) -> list[str]:
    if isinstance(names, str):
        raise TypeError(f'a list of names is needed, not the text "{names}"')
    return list(names)


def _setting(value: object) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (tuple, list)) and len(value) > 2:
        return ",".join(one if isinstance(one, str) else str(operator.index(one)) for one in value)
    if isinstance(value, (tuple, list)):
        low, high = value
        return f"[{_setting(low)}, {_setting(high)}]"
    return repr(finite(float(value)))  # type: ignore[arg-type]  # TypeError tells what it is
