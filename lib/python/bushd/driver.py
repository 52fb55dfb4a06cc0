"""Drives a session over a link within an asyncio loop: what is due goes out, what has come goes in."""

from __future__ import annotations

import asyncio
import collections
from collections.abc import Callable

from . import messages
from .links import Link, LinkEnded
from .session import Packet, Session
from .status import StatusCollector


class Driver:
    """Within one loop; none of its functions may be called from another thread."""

    def __init__(self, link: Link, session: Session) -> None:
        self.link = link
        self.session = session
        self.loop = asyncio.get_running_loop()
        self._outbox: collections.deque[Packet] = collections.deque()
        self._waiting: set[asyncio.Future[None]] = set()
        self._timer: asyncio.TimerHandle | None = None
        self._subscribers = 0
        self._closed = False
        self._writing = False
        self.loop.add_reader(link.fileno(), self._on_readable)

    def now(self) -> float:
        return self.loop.time()

    def turn(self) -> None:
        """To be called when something was begun."""
        if self._closed:
            return
        self._outbox.extend(self.session.poll(self.now()))
        self._flush()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        wake_at = self.session.wake_at()
        if wake_at is not None:
            self._timer = self.loop.call_at(wake_at, self.turn)
        self._wake()

    async def until(self, holds: Callable[[], bool]) -> None:
        """Returns as soon as this holds; it is looked at whenever something has come, and when time has run out."""
        self.turn()
        while not holds():
            future = self.loop.create_future()
            self._waiting.add(future)
            try:
                await future
            finally:
                self._waiting.discard(future)

    def send(self, packet: Packet) -> None:
        if not self._closed:
            self._outbox.append(packet)
            self._flush()

    def subscribe(self, collector: StatusCollector) -> None:
        self.session.watch(collector)
        self._subscribers += 1
        if self._subscribers == 1:
            self._send_subscription(True)

    def unsubscribe(self, collector: StatusCollector) -> None:
        self.session.unwatch(collector)
        self._subscribers -= 1
        if self._subscribers == 0:
            self._send_subscription(False)

    def close(self) -> None:
        if self._closed:
            return
        self._end("this client was closed")
        self._closed = True
        if self._timer is not None:
            self._timer.cancel()
        self.link.close()

    def _send_subscription(self, wanted: bool) -> None:
        if self.session.loses:
            return  # all hear all
        message = messages.subscribe_t(state=wanted, description=wanted, health=wanted)
        self.send(("SUBSCRIBE", message.encode()))

    def _on_readable(self) -> None:
        self._receive()
        self.turn()

    def _receive(self) -> None:
        try:
            for channel, payload in self.link.receive():
                self.session.receive(channel, payload, self.now())
        except LinkEnded as ended:
            self._end(str(ended))

    def _flush(self) -> None:
        try:
            while self._outbox and self.session.ended is None:
                self.link.send(*self._outbox[0])
                self._outbox.popleft()
        except BlockingIOError:
            if not self._writing:
                self._writing = True
                self.loop.add_writer(self.link.fileno(), self._on_writable)
        except LinkEnded as ended:
            self._receive()  # what has come before counts
            self._end(str(ended))

    def _on_writable(self) -> None:
        self._stop_writing()
        self._flush()

    def _stop_writing(self) -> None:
        if self._writing:
            self._writing = False
            self.loop.remove_writer(self.link.fileno())

    def _end(self, why: str) -> None:
        if self.session.ended is not None:
            return
        self.session.link_ended(why)
        self._outbox.clear()
        self._stop_writing()
        self.loop.remove_reader(self.link.fileno())
        self._wake()

    def _wake(self) -> None:
        for future in self._waiting:
            if not future.done():
                future.set_result(None)
