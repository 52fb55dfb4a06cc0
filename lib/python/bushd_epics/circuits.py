# mypy: allow-subclassing-any
"""Channel Access circuits: puts go to records, and their answers wait their turn behind the values that were told before.

caproto answers a put as soon as it is over, while monitors wait in queues: a client would hear that a move is done before it hears of
the last position. Here both take the same way. A client that does not read is let go, before what waits for it holds others back.
"""

from __future__ import annotations

import asyncio
import fcntl
import functools
import socket
import struct
import termios
import weakref
from collections import deque
from typing import Any

import caproto
from caproto.asyncio import server as caproto_server
from caproto.server.common import DisconnectedCircuit

from . import people
from .channels import BadPut
from .record import Putter
from .values import Event, Ready

AT_ONCE = 256  # of what waits, in one packet
MOST_WAITING = 8000
TCP_USER_TIMEOUT = 18  # of Linux; type stubs do not name it
ALIVE = (
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3),
    (socket.IPPROTO_TCP, TCP_USER_TIMEOUT, 3000),  # milliseconds
)
BYTES_ACKNOWLEDGED = struct.Struct("=120xQ")  # in what Linux tells by TCP_INFO


class Answer:
    """To a put."""

    def __init__(self, circuit: Circuit, command: Any) -> None:
        self.circuit = circuit
        self.command = command


class Circuit(caproto_server.VirtualCircuit):
    context: Any

    def __init__(self, circuit: Any, client: Any, context: Any) -> None:
        super().__init__(circuit, client, context)
        # A PC that is gone is noticed within seconds: jogs of its programs end with the connection.
        for level, option, value in ALIVE:
            self._socket.setsockopt(level, option, value)
        self._acknowledged = 0  # bytes, when it was looked at last

    @property
    def _socket(self) -> Any:
        return self.client.writer.get_extra_info("socket")

    def waiting_bytes(self) -> int:
        """That the client's PC has not acknowledged, or that wait here. A frozen program of a PC that runs has none until its buffer is full.

        None either where the PC has acknowledged any since this was asked last: to a client that reads often something is always on the way.
        """
        try:
            unsent: int = struct.unpack("i", fcntl.ioctl(self._socket.fileno(), termios.TIOCOUTQ, b"\0\0\0\0"))[0]
            told = self._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, BYTES_ACKNOWLEDGED.size)
        except (OSError, ValueError):
            return 0  # it is closed: its end is told
        before, (self._acknowledged,) = self._acknowledged, BYTES_ACKNOWLEDGED.unpack(told)
        if self._acknowledged != before:
            return 0
        here: int = self.client.writer.transport.get_write_buffer_size()
        return unsent + here

    def show_life(self) -> None:
        """An answer to an echo that nobody has asked for: clients take it, and nothing follows."""
        self.context.subscription_queue.put_nowait(Answer(self, caproto.EchoResponse()))

    def tell_rights(self) -> None:
        for channel in self.circuit.channels_sid.values():
            rights = caproto.AccessRightsResponse(cid=channel.cid, access_rights=self._rights_of(channel.name))
            self.context.subscription_queue.put_nowait(Answer(self, rights))

    @property
    def host(self) -> str:
        return str(self.circuit.address[0])

    @property
    def who(self) -> str:
        """As it says itself; for history and logs, not for rights."""
        return people.name_of(self.client_username or "unknown", self.client_hostname or self.host)

    async def _process_command(self, command: Any) -> Any:
        if isinstance(command, (caproto.WriteRequest, caproto.WriteNotifyRequest)):
            self._put(command)
            return []
        response = await super()._process_command(command)
        if isinstance(command, caproto.CreateChanRequest):
            return [self._rights(command, one) if isinstance(one, caproto.AccessRightsResponse) else one for one in response]
        return response

    def _rights(self, command: Any, response: Any) -> Any:
        return caproto.AccessRightsResponse(cid=command.cid, access_rights=self._rights_of(command.name))

    def _rights_of(self, name: str) -> Any:
        rights = caproto.AccessRights.READ
        if self.context[name].putter is not None and self.context.access.may_put(self.host):
            rights |= caproto.AccessRights.WRITE
        return rights

    def _put(self, command: Any) -> None:
        channel, entry = self._get_db_entry_from_command(command)
        answer = functools.partial(self._answer, command, channel)
        if entry.putter is None:
            return answer("it cannot be put")
        if not self.context.access.may_put(self.host):
            self.context.tell_refused(self.who, self.host, channel.name)
            return answer(f"{self.host} may not put: names.toml [allow]")
        try:
            value = entry.read_put(command)
        except BadPut as error:
            return answer(str(error))
        entry.putter(value, Putter(who=self.who, circuit=self, token=answer))

    def _answer(self, command: Any, channel: Any, error: str) -> None:
        if isinstance(command, caproto.WriteNotifyRequest):
            if error and not self.context.answers_failed_moves and caproto.parse_record_field(channel.name).field in (None, "", "VAL"):
                return
            status = caproto.CAStatus.ECA_PUTFAIL if error else caproto.CAStatus.ECA_NORMAL
            response = channel.write(
                ioid=command.ioid, data_type=command.data_type, data_count=command.data_count, status=status.value.code_with_severity
            )
        elif error:
            response = caproto.ErrorResponse(command, channel.cid, status=caproto.CAStatus.ECA_PUTFAIL, error_message=error[:250])
        else:
            return
        self.context.subscription_queue.put_nowait(Answer(self, response))

    def put_value(self, spec: Any, subscription: Any, ready: Ready) -> None:
        """Behind what waits. What a client has not taken yet is given up for newer values, or when it wants to hear nothing for a while."""
        if not self.events_on.is_set():
            self._tell_later(spec, subscription)
            return
        event = Event(subscription, ready)
        newest = self.unexpired_updates.get(event.subscriptionid)
        if newest is None:
            newest = self.unexpired_updates[event.subscriptionid] = deque(maxlen=subscription.db_entry.max_subscription_backlog)
        newest.append(event)
        self.subscription_queue.put_nowait(weakref.ref(event, functools.partial(self._given_up, spec, subscription)))

    def _given_up(self, spec: Any, subscription: Any, _: Any) -> None:
        if not self.events_on.is_set():
            self._tell_later(spec, subscription)

    def _tell_later(self, spec: Any, subscription: Any) -> None:
        """When it wants to hear again."""
        later = self.subscriptions_to_resend.setdefault(spec, [])
        if subscription not in later:
            later.append(subscription)

    async def subscription_queue_loop(self) -> None:
        """All that waits, in its order, as one packet."""
        self.events_on.set()
        try:
            while True:
                waiting = [await self.subscription_queue.get()]
                while not self.subscription_queue.empty() and len(waiting) < AT_ONCE:
                    waiting.append(self.subscription_queue.get_nowait())
                buffers = [buffer for command in map(_command, waiting) for buffer in self._bytes_of(command)]
                if buffers and self.connected:
                    await self._send_all(buffers)
        except asyncio.CancelledError:
            return
        except DisconnectedCircuit:
            await self._on_disconnect()
            self.circuit.disconnect()
            await self.context.circuit_disconnected(self)

    def _bytes_of(self, command: Any) -> list[Any]:
        """What is sent: values only while they are subscribed to."""
        if command is None:
            return []
        if isinstance(command, (Event, caproto.EventAddResponse)):
            asked_for = self.circuit.event_add_commands.get(command.subscriptionid)
            if asked_for is None or asked_for.sid not in self.circuit.channels_sid:
                return []
        if isinstance(command, Event):
            return [command.data]
        buffers: list[Any] = self.circuit.send(command)
        return buffers

    async def _send_all(self, buffers: list[Any]) -> None:
        try:
            await self._send_buffers(*buffers)
        except (OSError, caproto.CaprotoNetworkError) as error:
            raise DisconnectedCircuit(f"the client has gone: {error}") from error

    async def command_queue_loop(self) -> None:
        try:
            await super().command_queue_loop()
        finally:
            self.context.client_gone(self)


def _command(waiting: Any) -> Any:
    """Values that were overtaken by too many newer ones are gone."""
    return waiting.command if isinstance(waiting, Answer) else waiting()


class Context(caproto_server.Context):
    CircuitClass = Circuit

    async def subscription_queue_loop(self) -> None:
        while True:
            update = await self.subscription_queue.get()
            if isinstance(update, Answer):
                if update.circuit.connected and self._reads(update.circuit):
                    await update.circuit.subscription_queue.put(update)
            elif isinstance(update.values, Ready):
                self._put_values(update)
            else:
                await self._subscription_queue_iteration(*update)

    def _put_values(self, update: Any) -> None:
        for spec in update.sub_specs:
            for subscription in self.subscriptions[spec]:
                if self._reads(subscription.circuit):
                    subscription.circuit.put_value(spec, subscription, update.values)

    async def _subscription_queue_send(self, sub_spec: Any, sub: Any, **update: Any) -> None:
        if self._reads(sub.circuit):
            await super()._subscription_queue_send(sub_spec, sub, **update)

    def _reads(self, circuit: Any) -> bool:
        """One that does not is let go."""
        if circuit.subscription_queue.qsize() < MOST_WAITING:
            return True
        self.log.warning("%s does not read what it is sent, and is let go", circuit.host)
        circuit.client.close()
        return False
