"""The variables of Channel Access by PV Access as well (p4p), with the same rights, alarms and times.

What p4p calls comes in threads of its own, and goes to the event loop before anything of the bridge is touched. Values and answers to
puts leave in the order in which they come to be, as by Channel Access.

That a client has gone is not told here. So what ends with its client is asked for by Channel Access: jogs, and moves that are deferred.
"""

from __future__ import annotations

import asyncio
import functools
import ipaddress
import logging
from collections.abc import Callable
from typing import Any

from p4p import Value
from p4p.nt import NTEnum, NTScalar
from p4p.server import DynamicProvider
from p4p.server import Server as P4pServer
from p4p.server.raw import SharedPV

from . import channels, people
from .alarms import Alarm, Severity, Status
from .record import TARGETS, Putter
from .server import Server

LOG = logging.getLogger("bushd-epics")

EVERYWHERE = "0.0.0.0"  # IPv4, as Channel Access
DEVICE, UNDEFINED = 1, 6  # statuses of alarms, which are others than those of records
JOGS = ("JOGF", "JOGR")
BY_CHANNEL_ACCESS = "a client that goes is not seen by PV Access: use Channel Access for this"


class Variable:
    """One of them, for all who look at it; closed until the event loop has opened it."""

    def __init__(self, name: str, put: Callable[[Variable, Any], None]) -> None:
        """`put`: called by a thread of p4p."""
        self.name = name
        self.channel: Any = None
        self._put = put
        self._type: Any = None
        self.shared = SharedPV(handler=self)

    @property
    def field(self) -> str:
        return self.name.rpartition(".")[2]

    def put(self, _: Any, operation: Any) -> None:
        self._put(self, operation)

    # -- in the event loop

    def open(self, channel: Any) -> None:
        """Raises TypeError where PV Access has no type for it."""
        self._type = _type_of(channel)
        self.channel = channel
        self.shared.open(self._value())
        channel.told = self._tell

    def _tell(self) -> None:
        self.shared.post(self._value())

    def _value(self) -> Any:
        channel = self.channel
        value: Any = channel._data["value"]
        if isinstance(channel, channels.Enum):
            words = list(channel.enum_strings)
            value = {"index": words.index(value), "choices": words}
        told = {"value": value, "alarm": _alarm(channel.alarm_now()), "timeStamp": _time(channel._data["timestamp"])}
        if isinstance(channel, channels.Double):
            told |= _limits(channel._data)
        return Value(self._type, told)

    def read_put(self, operation: Any) -> Any:
        """Raises BadPut."""
        value = operation.value()
        try:
            if not value.changed("value"):
                raise ValueError("it puts no value")
            return self.channel.to_value(value["value.index"] if isinstance(self.channel, channels.Enum) else value["value"])
        except (LookupError, ValueError, TypeError, OverflowError) as error:
            raise channels.BadPut(f"no value of this field: {error}") from None


class Pva:
    """Serves what `server` serves, until it is stopped; made in the event loop. Raises RuntimeError where it cannot listen."""

    def __init__(self, server: Server, interfaces: list[str] | None, in_environment: bool) -> None:
        """`in_environment`: $EPICS_PVAS_INTF_ADDR_LIST says where to listen, unless `interfaces` do."""
        self._server = server
        self._loop = asyncio.get_running_loop()
        self._names: frozenset[str] = frozenset()
        self._names_are_old = False
        self._variables: dict[str, Variable] = {}
        self._look_at_names()
        server.names_changed = self._names_have_changed
        where = {} if in_environment and not interfaces else {"EPICS_PVAS_INTF_ADDR_LIST": " ".join(interfaces or [EVERYWHERE])}
        self._provider = DynamicProvider("bushd-epics", self)
        self._p4p = P4pServer(providers=[self._provider], conf=where)

    def stop(self) -> None:
        self._server.names_changed = None
        self._p4p.stop()

    # -- in threads of p4p

    def testChannel(self, name: str) -> Any:  # noqa: N802  (p4p calls it)
        if not name.startswith(self._server.prefix):
            return False
        return True if self._whole_name(name) is not None else DynamicProvider.NotYet

    def makeChannel(self, name: str, _: str) -> Any:  # noqa: N802  (p4p calls it)
        whole = self._whole_name(name)
        if whole is None:
            return None
        variable = self._variables.get(whole)
        if variable is None:
            new = Variable(whole, self._take_put)
            variable = self._variables.setdefault(whole, new)  # another thread may have been faster
            if variable is new:
                self._loop.call_soon_threadsafe(self._open, variable)
        return variable.shared

    def _take_put(self, variable: Variable, operation: Any) -> None:
        self._loop.call_soon_threadsafe(self._put, variable, operation)

    def _whole_name(self, name: str) -> str | None:
        """As it is listed: a record's VAL may be left out, and that of another variable may be there."""
        for spelled in (name, f"{name}.VAL", name.removesuffix(".VAL")):
            if spelled in self._names:
                return spelled
        return None

    # -- in the event loop

    def _names_have_changed(self) -> None:
        """Motors come by the hundred."""
        if not self._names_are_old:
            self._names_are_old = True
            self._loop.call_soon(self._look_at_names)

    def _look_at_names(self) -> None:
        self._names_are_old = False
        self._names = frozenset(self._server.names())

    def _open(self, variable: Variable) -> None:
        try:
            variable.open(self._server[variable.name])
        except TypeError as error:
            LOG.warning("%s is not shown by PV Access: %s", variable.name, error)

    def _put(self, variable: Variable, operation: Any) -> None:
        answer = Answer(operation)
        host = _host(operation.peer())
        who = people.name_of(operation.account() or "unknown", host)
        putter = variable.channel.putter
        if putter is None:
            return answer("it cannot be put")
        if not self._server.access.may_put(host):
            self._server.tell_refused(who, host, variable.name)
            return answer(f"{host} may not put: names.toml [allow]")
        try:
            value = variable.read_put(operation)
        except channels.BadPut as error:
            return answer(str(error))
        if self._ends_with_its_client(variable, value):
            return answer(BY_CHANNEL_ACCESS)
        putter(value, Putter(who=who, circuit=operation.peer(), token=answer))
        if not _is_waited_for(operation):
            answer("")

    def _ends_with_its_client(self, variable: Variable, value: Any) -> bool:
        if variable.field in JOGS:
            return bool(value)
        return variable.name == f"{self._server.prefix}deferMoves" or (variable.field in TARGETS and self._server.defers)


class Answer:
    """To a put; the first one counts."""

    def __init__(self, operation: Any) -> None:
        self._operation = operation

    def __call__(self, error: str) -> None:
        operation, self._operation = self._operation, None
        if operation is not None:
            operation.done(error=error) if error else operation.done()


def _is_waited_for(operation: Any) -> bool:
    """record[block=true], as of all servers of EPICS: the put is over when the motion is."""
    request = operation.pvRequest().todict()
    return str(request.get("record", {}).get("_options", {}).get("block", "")).lower() == "true"


def _host(peer: str) -> str:
    """The host of "10.0.0.1:4711" or "[::1]:4711"."""
    host = peer.rpartition(":")[0].strip("[]")
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    mapped = address.ipv4_mapped if isinstance(address, ipaddress.IPv6Address) else None
    return str(mapped or address)


@functools.cache
def _types() -> dict[type, Any]:
    return {
        channels.Double: NTScalar("d", display=True, control=True, form=True).type,
        channels.Long: NTScalar("i").type,
        channels.Short: NTScalar("h").type,
        channels.Text: NTScalar("s").type,
        channels.Enum: NTEnum().type,
    }


def _type_of(channel: Any) -> Any:
    try:
        return _types()[type(channel)]
    except KeyError:
        raise TypeError(f"{type(channel).__name__} has no type there") from None


def _alarm(alarm: Alarm) -> dict[str, Any]:
    if alarm.severity is Severity.NO_ALARM:
        return {"severity": 0, "status": 0, "message": ""}
    status = UNDEFINED if alarm.status is Status.UDF else DEVICE
    return {"severity": int(alarm.severity), "status": status, "message": alarm.reason or alarm.status.name}


def _time(stamp: Any) -> dict[str, int]:
    """Seconds of EPICS begin in 1990."""
    return {"secondsPastEpoch": int(stamp.secondsSinceEpoch) + 631152000, "nanoseconds": int(stamp.nanoSeconds)}


def _limits(data: dict[str, Any]) -> dict[str, Any]:
    def of(kind: str) -> dict[str, Any]:
        return {"limitLow": data.get(f"lower_{kind}_limit") or 0.0, "limitHigh": data.get(f"upper_{kind}_limit") or 0.0}

    return {"display": {**of("disp"), "units": data["units"], "precision": data["precision"]}, "control": of("ctrl")}
