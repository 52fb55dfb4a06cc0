"""What is shown by Channel Access: the fields of records, made when somebody asks for them, and what belongs to all motors."""

from __future__ import annotations

import asyncio
import dataclasses
import logging
from collections.abc import Callable, Sequence
from typing import Any

import caproto

from . import beside, channels, compare, events, trigger
from .access import Access
from .circuits import Circuit, Context
from .compare import Compare
from .daemon import Daemon
from .fields import FIELDS, Kind, Value
from .jogs import Jogs
from .leaves import Leaves
from .profile import Profile, all_fields
from .record import Putter, Record
from .tasks import Tasks, loop_time
from .trigger import Trigger

LOG = logging.getLogger("bushd-epics")

LOOK_UP_EVERY_S = 10.0
JOGS_ARE_LOOKED_AT_S = 0.25
ABLE = ("Enable", "Disable")
DESCRIBING = ("EGU", "PREC", "HLM", "LLM")  # what positions are told with


class Pages:
    """The variables of one record."""

    def __init__(self, record: Record, daemon: Daemon, jogs: Jogs) -> None:
        self.record = record
        self._flights = daemon.flights
        self._jogs = jogs
        self._deliver = daemon.deliver
        self._alarm = caproto.ChannelAlarm(
            status=int(record.alarm.status), severity=int(record.alarm.severity), alarm_string=record.alarm.reason
        )
        self._fields: dict[str, Any] = {}
        record.shown = set(DESCRIBING)
        self._able: Any = None
        self._beside: dict[type[Compare | Trigger], Leaves] = {}
        self._held = False

    def field(self, name: str) -> Any:
        """Raises KeyError where a motor record has none of this name."""
        channel = self._fields.get(name)
        if channel is None:
            spec = FIELDS[name]
            channel = channels.make(spec.kind, self.record.values[name], spec.words, self._alarm, "motor")
            channel.putter = lambda value, by: self._put(name, value, by)
            channel.reason = self._reason
            self._fields[name] = channel
            self.record.shown = {*DESCRIBING, *self._fields}
            if spec.is_position and isinstance(channel, channels.Double):
                self._describe(name, channel)
        return channel

    def able(self) -> Any:
        """`NAME_able`: 1, Disable, of a motor that is held."""
        if self._able is None:
            self._able = channels.make(Kind.ENUM, int(self._held), ABLE, self._alarm, "bo")
            self._able.putter = self._put_able
            self._able.reason = self._reason
        return self._able

    def beside(self, name: str) -> Any:
        """`NAMEPCOEnable`, `NAME_trgArm`, and what belongs to them. Raises KeyError."""
        kind: type[Compare | Trigger] = Compare if name in compare.FIELDS else Trigger
        leaves = self._beside.get(kind)
        if leaves is None:
            made = kind(self.record.name)
            fields = compare.FIELDS if kind is Compare else trigger.FIELDS
            leaves = Leaves(fields, made.values, lambda field, value, by: self._flights.put(made, field, value, by), self._alarm)
            self._beside[kind] = leaves
            self._flights.add_beside(self.record, made, leaves.show)
        channel = leaves.find(name)
        leaves.describe(str(self.record.values["EGU"]), int(self.record.values["PREC"]))
        return channel

    def post(self, event: events.Post) -> None:
        channel = self._fields.get(event.field)
        if channel is not None:
            channel.show(event.value)
        if event.field in DESCRIBING:
            for name, described in self._fields.items():
                if FIELDS[name].is_position and isinstance(described, channels.Double):
                    self._describe(name, described)

    def alarm(self, event: events.Raise) -> None:
        alarm = event.alarm
        self._alarm._data.update(
            status=caproto.AlarmStatus(int(alarm.status)), severity=caproto.AlarmSeverity(int(alarm.severity)), alarm_string=alarm.reason[:39]
        )
        for channel in [*self._fields.values(), *([] if self._able is None else [self._able])]:
            channel.take_alarm()
        for leaves in self._beside.values():
            leaves.alarm_has_changed()

    def held(self, held: bool) -> None:
        if held != self._held:
            self._held = held
            if self._able is not None:
                self._able.show(int(held))

    def _reason(self) -> str:
        return self.record.alarm.reason

    def _describe(self, name: str, channel: channels.Double) -> None:
        values = self.record.values
        dial = name in ("DVAL", "DRBV", "DHLM", "DLLM")
        low, high = ("DLLM", "DHLM") if dial else ("LLM", "HLM")
        limited = name in ("VAL", "RBV", "DVAL", "DRBV")
        channel.describe(
            str(values["EGU"]), int(values["PREC"]), float(values[low]) if limited else 0.0, float(values[high]) if limited else 0.0
        )

    def _put(self, name: str, value: Value, by: Putter) -> None:
        if name in ("JOGF", "JOGR") and value and self._jogs.renew(self.record, name, by.circuit, loop_time()):
            by.token("")
            return
        if self._flights.flies(self.record) and (name == "STOP" and value or name == "SPMG" and not value):
            self._flights.stop(self.record, by)
            by = dataclasses.replace(by, token=None)
        self.record.put(name, value, by, loop_time())
        self._deliver(self.record)

    def _put_able(self, value: Value, by: Putter) -> None:
        self.record.hold(bool(value), by)
        self._deliver(self.record)


class Server(Context):
    """All variables, by name; also what daemons show their records on."""

    def __init__(self, prefix: str, access: Access, interfaces: list[str] | None = None) -> None:
        super().__init__({}, interfaces)
        self.prefix = prefix
        self.access = access
        self.answers_failed_moves = True
        self.names_changed: Callable[[], None] | None = None  # is called then
        self.jogs = Jogs()
        self._all: list[Daemon] = []
        self._daemons: dict[Record, Daemon] = {}
        self._pages: dict[str, Pages] = {}
        self._of: dict[Record, Pages] = {}
        self._common: dict[str, Any] = {}
        self._profiles: dict[str, tuple[Profile, Leaves]] = {}  # by what their names begin with
        self._refused: set[str] = set()
        self._work = Tasks()

    def add_daemon(self, daemon: Daemon) -> None:
        self._all.append(daemon)

    def add_profile(self, daemon: Daemon, begins: str, motors: Sequence[str]) -> None:
        """`begins`: what all its names begin with, "LAB:pm1:"."""
        if begins in self._profiles:
            LOG.error("%s is the name of two profiles: the second one is not shown", begins)
            return
        profile = Profile(begins, motors)
        leaves = Leaves(profile.fields, profile.values, lambda field, value, by: daemon.flights.put(profile, field, value, by))
        daemon.flights.add(profile, leaves.show)
        self._profiles[begins] = profile, leaves

    def make_common(self) -> None:
        """Makes what is common to all motors."""
        stop = channels.make(Kind.SHORT, 0, (), caproto.ChannelAlarm(), "bo")
        stop.putter = self._put_all_stop
        defer = channels.make(Kind.SHORT, 0, (), caproto.ChannelAlarm(), "bo")
        defer.putter = self._put_defer
        self._common = {f"{self.prefix}allstop": stop, f"{self.prefix}deferMoves": defer}

    def names(self) -> list[str]:
        """All of them."""
        records = [f"{name}.{field}" for name in sorted(self._pages) for field in FIELDS]
        able = [f"{name}_able" for name in sorted(self._pages)]
        motors = [name for name, pages in sorted(self._pages.items()) if not pages.record.is_axis]
        beside = [f"{name}{field}" for name in motors for field in (*compare.FIELDS, *trigger.FIELDS)]
        return [*records, *able, *beside, *all_fields(profile for profile, _ in self._profiles.values()), *self._common]

    def records(self) -> list[str]:
        """The names of motors and axes that are shown."""
        return sorted(self._pages)

    # -- for caproto

    def __getitem__(self, name: str) -> Any:
        """Raises CaprotoKeyError. A name has many spellings, so none is kept."""
        try:
            parsed = caproto.parse_record_field(name)
            if parsed.modifiers is not None and parsed.modifiers.filter_ is not None:
                raise ValueError("filters are not served")
            channel = self._find(parsed.record, parsed.field or "VAL")
        except (KeyError, ValueError):
            raise caproto.CaprotoKeyError(f"no such variable: {name}") from None
        if caproto.RecordModifiers.long_string in (parsed.modifiers or {}) and not isinstance(channel, channels.Text):
            raise caproto.CaprotoKeyError(f"no text: {name}")
        return channel

    def _find(self, record: str, field: str) -> Any:
        """Raises KeyError."""
        if record in self._pages:
            return self._pages[record].field(field)
        if record.endswith("_able") and record.removesuffix("_able") in self._pages:
            return self._pages[record.removesuffix("_able")].able().get_field(field)
        if record in self._common:
            return self._common[record].get_field(field)
        return self._find_beside(record).get_field(field)

    def _find_beside(self, name: str) -> Any:
        """A variable of a profile, of a position compare or of a trigger. Raises KeyError."""
        begins, colon, field = name.rpartition(":")
        if begins + colon in self._profiles and field in self._profiles[begins + colon][1]:
            return self._profiles[begins + colon][1].find(field)
        motor, field = beside.split(name)
        pages = self._pages[motor]
        if pages.record.is_axis:
            raise KeyError(name)
        return pages.beside(field)

    async def look_up_names(self) -> None:
        """Looks up the hosts that may put, as long as some were not found: at boot the network may not be there yet."""
        while True:
            await asyncio.sleep(LOOK_UP_EVERY_S)
            found = bool(self.access.unknown) and await asyncio.to_thread(self.access.look_up)
            if found:
                for circuit in self.circuits:
                    circuit.tell_rights()

    async def watch_jogs(self) -> None:
        while True:
            await asyncio.sleep(JOGS_ARE_LOOKED_AT_S)
            records = list(self._daemons)
            for record, circuit, why in self.jogs.look(records, Circuit.waiting_bytes, loop_time()):
                LOG.warning("%s: its jog ends: %s", record.name, why)
                record.client_gone(circuit, loop_time())
                self._daemons[record].deliver(record)
            # Something has to be on the way to a PC that is gone, for its silence to be seen.
            for circuit in {job.circuit for record in records for job in self.jogs.of(record)}:
                circuit.show_life()

    def client_gone(self, circuit: Circuit) -> None:
        for record, daemon in self._daemons.items():
            record.client_gone(circuit, loop_time())
            daemon.deliver(record)

    def tell_refused(self, who: str, host: str, name: str) -> None:
        """Once for each host."""
        if host not in self._refused and len(self._refused) < 1000:
            self._refused.add(host)
            LOG.warning("%s at %s may not put (%s): names.toml [allow], or --read-only", who, host, name)

    @property
    def defers(self) -> bool:
        """Targets are gathered."""
        return any(daemon.deferred.on for daemon in self._all)

    # -- for daemons

    def appear(self, record: Record) -> None:
        daemon = next(one for one in self._all if record in one.records.values())
        if record.name in self._pages:
            LOG.error("%s is the name of two motors: the second one is not shown", record.name)
        else:
            self._pages[record.name] = Pages(record, daemon, self.jogs)
        self._daemons[record] = daemon
        self._of[record] = self._pages[record.name]
        if self.names_changed is not None:
            self.names_changed()

    def post(self, record: Record, event: events.Post) -> None:
        if self._of[record].record is record:
            self._of[record].post(event)

    def alarm(self, record: Record, event: events.Raise) -> None:
        if self._of[record].record is record:
            self._of[record].alarm(event)

    def held(self, record: Record, held: bool) -> None:
        if self._of[record].record is record:
            self._of[record].held(held)

    # -- of all motors

    def _put_all_stop(self, value: Value, by: Putter) -> None:
        if not value:
            by.token("")
            return
        self._work.spawn(self._stop_all(by))

    async def _stop_all(self, by: Putter) -> None:
        ended = await asyncio.gather(*(daemon.stop_all(str(by.who)) for daemon in self._all), return_exceptions=True)
        failed = [str(error) for error in ended if isinstance(error, BaseException)]
        for error in failed:
            LOG.error("allstop: %s", error)
        self._common[f"{self.prefix}allstop"].show(0)
        by.token("; ".join(failed))

    def _put_defer(self, value: Value, by: Putter) -> None:
        self._common[f"{self.prefix}deferMoves"].show(int(bool(value)))
        for daemon in self._all:
            daemon.defer(bool(value))
        by.token("")
