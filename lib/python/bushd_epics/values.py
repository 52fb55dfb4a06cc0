"""Numbers as they go to those who watch them, in as few steps as can be: positions come ten times a second for each motor that moves.

caproto makes a struct, an array and a command of each value, and looks at all of them again when they are sent. Most clients want a number with
its alarm and its time, so those bytes are made at once here. What is asked for in another form goes caproto's way.
"""

from __future__ import annotations

import struct
from typing import Any

from caproto import ChannelType

# Status, severity, seconds and nanoseconds since 1990, and the value behind what aligns it (db_access.h: struct dbr_time_*).
LAYOUTS = {
    (ChannelType.DOUBLE, "TIME_DOUBLE"): struct.Struct(">hhII4xd"),
    (ChannelType.LONG, "TIME_LONG"): struct.Struct(">hhIIi"),
    (ChannelType.INT, "TIME_INT"): struct.Struct(">hhII2xh"),
}
_HEADER = struct.Struct(">HHHHII")
_EVENT_ADD = 1
_NORMAL = 1


class Ready:
    """A value as the payload of an event."""

    __slots__ = ("payload",)

    def __init__(self, payload: bytes) -> None:
        self.payload = payload


class Event:
    """A value for one subscription."""

    __slots__ = ("__weakref__", "data", "subscriptionid")

    def __init__(self, subscription: Any, ready: Ready) -> None:
        self.subscriptionid = subscription.subscriptionid
        head = (_EVENT_ADD, len(ready.payload), subscription.data_type, subscription.data_count or 1, _NORMAL, self.subscriptionid)
        self.data = _HEADER.pack(*head) + ready.payload


def ready(channel: Any, asked_for: str) -> Ready | None:
    """What this channel is now, in the form of that name; None: caproto is to make it, as all arrays."""
    layout = LAYOUTS.get((channel.data_type, asked_for))
    if layout is None or channel.max_length > 1:
        return None
    alarm, data = channel.alarm, channel._data
    stamp, value = data["timestamp"], data["value"]
    if channel.data_type is not ChannelType.DOUBLE:
        value = int(value)  # targets in steps are put as any number is
    return Ready(layout.pack(int(alarm.status), int(alarm.severity), stamp.secondsSinceEpoch, stamp.nanoSeconds, value))
