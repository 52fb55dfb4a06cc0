"""What bushd tells of a motor, as a record takes it."""

from __future__ import annotations

import dataclasses

from bushd import model

from .events import Seen, Speeds
from .scale import Scale, resolution

TRUSTED = (model.Trust.KNOWN, model.Trust.RESTORED)


def seen(motor: model.Motor) -> Seen:
    inhibited = model.Inhibited
    low, high = motor.soft_limits or (None, None)
    return Seen(
        user=motor.position,
        dial=motor.dial,
        steps=motor.position_steps,
        target=motor.target,
        target_steps=motor.target_steps,
        moving=motor.moving,
        busy=motor.activity in (model.Activity.MOVE, model.Activity.HOME),
        armed=motor.activity is model.Activity.ARMED,
        live=motor.trust not in (model.Trust.UNKNOWN, model.Trust.STALE),
        uncertain="" if motor.trust in TRUSTED else motor.uncertain_reason or motor.trust.value,
        steps_per_s=motor.velocity_steps_per_s,
        enabled=motor.enabled,
        held=motor.held,
        plus_limit=motor.inhibited in (inhibited.POSITIVE, inhibited.BOTH),
        minus_limit=motor.inhibited in (inhibited.NEGATIVE, inhibited.BOTH),
        at_home="home" in motor.inputs,
        scale=Scale(resolution("" if motor.unit == "steps" else motor.steps_per_unit), motor.negative, motor.offset),
        low=low,
        high=high,
        unit=motor.unit,
        precision=motor.precision,
        description=motor.description,
        place=f"@{motor.mcu} {motor.output}",
    )


def seen_at_end(before: Seen, result: model.MotorResult) -> Seen:
    """After a motion that has reached its target: what the states that are to come will say."""
    return dataclasses.replace(
        before,
        user=result.position,
        dial=result.dial,
        steps=result.position_steps,
        target=result.position,
        target_steps=result.position_steps,
        moving=False,
        busy=False,
        armed=False,
        steps_per_s=0.0,
    )


def speeds(table: model.Table, entry: model.TableEntry, step: float, max_speed: float | None, share: float) -> Speeds:
    """The speeds of a motor with this table. `share`: of the table's acceleration; `max_speed`: not exceeded, in units a second.

    A ramp is as long as its delays together down to the shortest one that is used.
    """
    top = entry.max_steps_per_s * step
    if max_speed is not None:
        top = min(top, max_speed)
    shortest_ns = 1e9 * step / top
    delays_ns = [code * table.time_unit_ns for code in table.accel]
    ramp_s = sum(delay for delay in delays_ns if delay > shortest_ns) / 1e9 / share
    return Speeds(top=top, least=min(entry.start_steps_per_s * step, top), ramp_s=ramp_s)
