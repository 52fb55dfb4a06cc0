"""Names of a motor's variables that are no fields of its record: those of its position compare and of its trigger."""

from __future__ import annotations

from . import compare, trigger


def split(name: str) -> tuple[str, str]:
    """The motor and the field, `PCOEnable`. Raises KeyError."""
    for begin, fields in (("PCO", compare.FIELDS), ("_trg", trigger.FIELDS)):
        motor, _, rest = name.rpartition(begin)
        if begin + rest in fields:  # else the name of a motor may have these letters: that of mPCO1_trgArm
            return motor, begin + rest
    raise KeyError(name)
