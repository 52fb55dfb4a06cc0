"""Variables beside those of a record: their values, and what is to be done about them. Without caproto and without a socket."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, TypeVar

from . import events
from .fields import Field

Own = TypeVar("Own")  # events beside posts and answers to puts


class Variables(Generic[Own]):
    def __init__(self, fields: Mapping[str, Field]) -> None:
        self.values: dict[str, Any] = {field: spec.initial for field, spec in fields.items()}
        self._out: list[events.Post | events.Done | Own] = []

    def take(self) -> list[events.Post | events.Done | Own]:
        out, self._out = self._out, []
        return out

    def _post(self, field: str, value: Any) -> None:
        if self.values[field] != value:
            self.values[field] = value
            self._out.append(events.Post(field, value))

    def _done(self, token: Any, error: str = "") -> None:
        """`token`: of a put; None: nobody waits for it."""
        if token is not None:
            self._out.append(events.Done(token, error))
