"""All that can be asked of the daemon, as requests of `session`: one function each.

Names of motors and numbers go as they come; the daemon resolves them, checks every range, and refuses with a reason.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from . import codec, messages, model
from .session import Request

STEPS = "steps"

Amounts = Mapping[str, float]
Names = Iterable[str]
Rows = Iterable[Iterable[float]]
# (N, A, F), and of functions that write (N, A, F, data).
Cycle = tuple[int, int, int] | tuple[int, int, int, int]


def move(
    amounts: Amounts, *, absolute: bool, in_steps: bool, speed: float | None = None, dry_run: bool = False
) -> Request:
    message = messages.move_t()
    message.kind = messages.move_t.ABSOLUTE if absolute else messages.move_t.RELATIVE
    message.dry_run = bool(dry_run)
    _put_speed(message, speed, in_steps)
    _put_amounts(message, amounts, in_steps)
    return Request("MOVE", message)


def move_line(
    amounts: Amounts,
    *,
    absolute: bool,
    in_steps: bool,
    speed: float | None = None,
    duration_s: float | None = None,
    dry_run: bool = False,
) -> Request:
    message = messages.move_line_t()
    message.kind = messages.move_line_t.ABSOLUTE if absolute else messages.move_line_t.RELATIVE
    message.dry_run = bool(dry_run)
    _put_speed(message, speed, in_steps)
    _put_duration(message, duration_s)
    _put_amounts(message, amounts, in_steps)
    return Request("MOVE_LINE", message)


# What one message holds (move_path_t, follow_t); more come in several.
MOST_VALUES = 4096


def arm_line(
    amounts: Amounts,
    *,
    absolute: bool,
    in_steps: bool,
    falling: bool = False,
    delay_us: int = 50,
    speed: float | None = None,
    duration_s: float | None = None,
    while_connected: bool = False,
) -> Request:
    message = messages.arm_line_t()
    message.while_connected = bool(while_connected)
    message.edge = messages.arm_line_t.FALLING if falling else messages.arm_line_t.RISING
    message.delay_us = operator.index(delay_us)
    message.kind = messages.arm_line_t.ABSOLUTE if absolute else messages.arm_line_t.RELATIVE
    _put_speed(message, speed, in_steps)
    _put_duration(message, duration_s)
    _put_amounts(message, amounts, in_steps)
    return Request("ARM_LINE", message)


def move_path(
    motors: Names,
    points: Rows,
    *,
    exact: bool = False,
    in_steps: bool = False,
    speed: float | None = None,
    speeds: Iterable[float] = (),
    dry_run: bool = False,
) -> list[Request]:
    """The last of them begins the motion; those before it carry points only."""
    names, rows = list(motors), [list(point) for point in points]
    limits = [codec.finite(float(limit)) for limit in speeds]
    made = []
    for first, some in _pieces(names, rows):
        message = messages.move_path_t()
        message.rows, message.first_row = len(rows), first
        message.corners = messages.move_path_t.EXACT if exact else messages.move_path_t.CONTINUOUS
        message.dry_run = bool(dry_run)
        _put_speed(message, speed, in_steps)
        _named(message, names)
        message.positions = _positions(some)
        message.position_count = len(message.positions)
        message.speeds = limits[first : first + len(some)]
        message.speed_count = len(message.speeds)
        made.append(Request("MOVE_PATH", message))
    if limits and len(limits) != len(rows):
        raise ValueError(f"{len(limits)} speeds for {len(rows)} points")
    return made


def follow(
    motors: Names, time_s: Iterable[float], positions: Rows, *, array: int, cubic: bool = False, stretch: float = 1.0
) -> list[Request]:
    """The last of them begins the motion; those before it carry rows only."""
    names, rows, times = list(motors), [list(row) for row in positions], [codec.finite(float(t)) for t in time_s]
    if len(times) != len(rows):
        raise ValueError(f"{len(times)} times for {len(rows)} rows")

    def part(kind: int, first: int, some: list[list[float]]) -> Request:
        message = messages.follow_t()
        message.part, message.array = kind, array
        message.cubic, message.stretch = bool(cubic), codec.finite(float(stretch))
        _named(message, names)
        message.time_s = times[first : first + len(some)]
        message.row_count = len(message.time_s)
        message.positions = _positions(some)
        message.position_count = len(message.positions)
        return Request("FOLLOW", message)

    kind = messages.follow_t
    pieces = list(_pieces(names, rows))
    made = [part(kind.ROWS, first, some) for first, some in pieces[:-1]]
    return [*made, part(kind.LAST_ROWS, *pieces[-1]), part(kind.RUN, 0, [])]


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


def _positions(rows: list[list[float]]) -> list[float]:
    return [codec.finite(float(position)) for row in rows for position in row]


def arm(
    amounts: Amounts,
    *,
    in_steps: bool,
    falling: bool = False,
    delay_us: int = 50,
    speed: float | None = None,
    while_connected: bool = False,
) -> Request:
    message = messages.arm_t()
    message.while_connected = bool(while_connected)
    message.edge = messages.arm_t.FALLING if falling else messages.arm_t.RISING
    message.delay_us = operator.index(delay_us)
    _put_speed(message, speed, in_steps)
    _put_amounts(message, amounts, in_steps)
    return Request("ARM", message)


def home(names: Names, *, every: bool = False, speed: float | None = None, in_steps: bool = False) -> Request:
    message = messages.home_t()
    message.all = bool(every)
    _put_speed(message, speed, in_steps)
    return Request("HOME", _named(message, names))


def jog(motor: str, speed: float, *, in_steps: bool, keepalive_ms: int, steps_after: int | None = None) -> Request:
    message = messages.jog_t()
    message.motor = codec.text(motor)
    message.speed = codec.finite(float(speed))
    message.speed_in_steps = in_steps
    message.keepalive_ms = operator.index(keepalive_ms)
    message.steps_after = -1 if steps_after is None else operator.index(steps_after)
    return Request("JOG", message)


def renew_jog(motor: str, *, keepalive_ms: int) -> Request:
    request = jog(motor, 0.0, in_steps=False, keepalive_ms=keepalive_ms)
    request.message.renew = True
    return request


def stop(names: Names) -> Request:
    return Request("STOP", _named(messages.stop_t(), names), repeatable=True)


def emergency_stop() -> Request:
    return Request("EMERGENCY_STOP", messages.emergency_stop_t(), repeatable=True)


def set_position(amounts: Amounts, *, in_steps: bool, dial: bool) -> Request:
    message = messages.set_position_t()
    message.dial = bool(dial)
    _put_amounts(message, amounts, in_steps)
    return Request("SET_POSITION", message)


def position_compare(
    motor: str, position: float, *, in_steps: bool, positive: bool, negative: bool, delay_us: int, width_us: int
) -> Request:
    message = messages.position_compare_t()
    message.position = _amount(motor, position, in_steps)
    message.arrivals = (message.POSITIVE if positive else 0) | (message.NEGATIVE if negative else 0)
    message.delay_us = operator.index(delay_us)
    message.width_us = operator.index(width_us)
    return Request("POSITION_COMPARE", message)


_OF_MOTORS = {
    "CONFIRM": messages.confirm_t,
    "ENABLE": messages.enable_t,
    "DISABLE": messages.disable_t,
    "CLEAR_FAULTS": messages.clear_faults_t,
    "DISARM": messages.disarm_t,
    "PAUSE": messages.pause_t,
    "RESUME": messages.resume_t,
    "HOLD": messages.hold_t,
    "RELEASE": messages.release_t,
}


def of_motors(channel: str, names: Names) -> Request:
    """Those that name motors and nothing else."""
    return Request(channel, _named(_OF_MOTORS[channel](), names))


def history(motor: str, most: int) -> Request:
    message = messages.get_history_t()
    message.motor = codec.text(motor)
    message.most = operator.index(most)
    return Request("GET_HISTORY", message, repeatable=True)


def show_configuration(names: Names) -> Request:
    message = messages.configure_t()
    message.kind = messages.configure_t.SHOW
    return Request("CONFIGURE", _named(message, names), repeatable=True)


def change_configuration(motor: str, changes: Mapping[str, object]) -> Request:
    """Values: a number, a word, True or False, (low, high), a longer tuple of whole numbers and words, or None for none."""
    message = messages.configure_t()
    message.kind = messages.configure_t.CHANGE
    message.change_motors = [codec.text(motor)] * len(changes)
    message.change_keys = [codec.text(key) for key in changes]
    message.change_values = [_setting(value) for value in changes.values()]
    message.change_count = len(changes)
    return Request("CONFIGURE", message)


_CAMAC_MODES = {
    "single": messages.camac_request_t.SINGLE,
    "repeat": messages.camac_request_t.REPEAT,
    "q-stop": messages.camac_request_t.Q_STOP,
    "scan": messages.camac_request_t.SCAN,
}
_LAST_STATION, _LAST_SUBADDRESS = 23, 15


def camac(
    cycles: Iterable[Cycle], *, crate: int = 1, mode: str = "single", count: int | None = None, last: tuple[int, int] | None = None
) -> Request:
    if mode not in _CAMAC_MODES:
        raise ValueError(f"mode={mode!r}; allowed: {', '.join(_CAMAC_MODES)}")
    listed = [tuple(map(operator.index, cycle)) for cycle in cycles]
    if any(len(cycle) not in (3, 4) for cycle in listed):
        raise ValueError("a cycle is (N, A, F) or (N, A, F, data)")
    message = messages.camac_request_t()
    message.crate = operator.index(crate)
    message.mode = _CAMAC_MODES[mode]
    message.count = len(listed) if count is None else operator.index(count)
    message.last_station, message.last_subaddress = last or (_LAST_STATION, _LAST_SUBADDRESS)
    message.cycle_count = len(listed)
    message.stations = [cycle[0] for cycle in listed]
    message.subaddresses = [cycle[1] for cycle in listed]
    message.functions = [cycle[2] for cycle in listed]
    message.data = [cycle[3] if len(cycle) == 4 else 0 for cycle in listed]
    return Request("CAMAC", message)


def list_tables() -> Request:
    return Request("LIST_TABLES", messages.list_tables_t(), repeatable=True)


def get_table(name: str) -> Request:
    message = messages.get_table_t()
    message.table = codec.text(name)
    return Request("GET_TABLE", message, repeatable=True)


def set_table(name: str, table: model.Table) -> Request:
    message = messages.set_table_t()
    message.table = codec.text(name)
    message.expected_hash = codec.text(table.hash)
    content = message.content
    content.name = codec.text(table.name)
    content.description = codec.text(table.description)
    content.revision = table.revision
    content.time_unit_ns = table.time_unit_ns
    content.cruise = table.cruise
    content.accel = [operator.index(code) for code in table.accel]
    content.accel_count = len(content.accel)
    content.decel = [operator.index(code) for code in table.decel]
    content.decel_count = len(content.decel)
    return Request("SET_TABLE", message)


def use_table(group: str, table: str) -> Request:
    message = messages.use_table_t()
    message.group = codec.text(group)
    message.table = codec.text(table)
    return Request("USE_TABLE", message)


def reload_tables() -> Request:
    return Request("RELOAD_TABLES", messages.reload_tables_t())


def _amount(motor: str, value: float, in_steps: bool) -> Any:
    amount = messages.motor_amount_t()
    amount.motor = codec.text(motor)
    amount.in_steps = in_steps
    if in_steps:
        amount.steps = _whole(motor, value)
    else:
        amount.user = codec.finite(float(value))
    return amount


def _whole(motor: str, steps: float) -> int:
    """A number of steps may come as 400.0, from an array."""
    whole = steps if isinstance(steps, int) else int(codec.finite(float(steps)))
    if whole != steps:
        raise ValueError(f"{motor}: {steps} is no whole number of steps")
    return whole


def _put_amounts(message: Any, amounts: Amounts, in_steps: bool) -> None:
    message.motors = [_amount(motor, value, in_steps) for motor, value in amounts.items()]
    message.motor_count = len(message.motors)
    if not message.motors:
        raise ValueError("no motor is named")


def _put_speed(message: Any, speed: float | None, in_steps: bool) -> None:
    if speed is None:
        return
    message.speed = codec.finite(float(speed))
    message.speed_in_steps = in_steps
    if message.speed <= 0:
        raise ValueError(f"a speed of {speed:g}: it is to be above 0")


def _put_duration(message: Any, duration_s: float | None) -> None:
    if duration_s is None:
        return
    # 0 on the bus of messages is "none".
    if not codec.finite(float(duration_s)) > 0:
        raise ValueError(f"duration_s={duration_s}; allowed: above 0")
    message.duration_s = float(duration_s)


def _named(message: Any, names: Names) -> Any:
    if isinstance(names, str):
        raise TypeError(f'a list of names is needed, not the text "{names}"')
    message.motors = [codec.text(name) for name in names]
    message.motor_count = len(message.motors)
    return message


def _setting(value: object) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return codec.text(value)
    if isinstance(value, (tuple, list)) and len(value) > 2:
        return ",".join(codec.text(one) if isinstance(one, str) else str(operator.index(one)) for one in value)
    if isinstance(value, (tuple, list)):
        low, high = value
        return f"[{_setting(low)}, {_setting(high)}]"
    return repr(codec.finite(float(value)))  # type: ignore[arg-type]  # TypeError tells what it is
