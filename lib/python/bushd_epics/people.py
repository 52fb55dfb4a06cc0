"""A connection to the daemon for each user of EPICS, so that its history names who has asked for what."""

from __future__ import annotations

import asyncio
import os
import weakref
from collections.abc import Awaitable, Callable

import bushd.aio

MOST = 16  # connections; who comes after that takes the place of the one that was used least lately

Connect = Callable[[str], Awaitable[bushd.aio.Client]]


def name_of(user: str, host: str) -> str:
    """For history and logs."""
    return ":".join("".join(c if 33 <= ord(c) < 127 and c != ":" else "_" for c in word)[:20] for word in (user, host))


class People:
    def __init__(self, connect: Connect) -> None:
        """`connect`: as a program of this name. Raises NoDaemon."""
        self._connect = connect
        self.spare: bushd.aio.Client | None = None  # the bridge's own
        self._clients: dict[str, bushd.aio.Client] = {}
        self._at_work: dict[str, int] = {}
        # Held while the connection of a user is made: a second one would never be closed.
        self._connecting: weakref.WeakValueDictionary[str, asyncio.Lock] = weakref.WeakValueDictionary()

    async def client(self, who: str) -> bushd.aio.Client:
        """Connected, anew if the daemon has closed the last one. Raises NoDaemon."""
        connecting = self._connecting.setdefault(who, asyncio.Lock())
        async with connecting:
            client = self._clients.pop(who, None)
            if client is not None and not client.connected:
                await client.close()
                client = None
            if client is None:
                await self._make_room()
                client = await self._connect(f"epics:{who}")
            self._clients[who] = client  # the last one is the one that was used last
            return client

    def ready(self, who: str) -> tuple[bushd.aio.Client | None, bool]:
        """What a stop can be sent over at once, and whether that is the connection of this user."""
        own = self._clients.get(who)
        if own is not None and own.connected:
            return own, True
        others = [*reversed(self._clients.values()), *([] if self.spare is None else [self.spare])]
        return next((client for client in others if client.connected), None), False

    def begin(self, who: str) -> None:
        """It must not be closed until `end`: that would end its jogs."""
        self._at_work[who] = self._at_work.get(who, 0) + 1

    def end(self, who: str) -> None:
        self._at_work[who] -= 1
        if not self._at_work[who]:
            del self._at_work[who]

    async def close(self) -> None:
        clients, self._clients = list(self._clients.values()), {}
        for client in clients:
            await client.close()

    async def _make_room(self) -> None:
        idle = [who for who in self._clients if who not in self._at_work]
        for who in idle[: max(0, len(self._clients) - MOST + 1)]:
            await self._clients.pop(who).close()


async def connect(socket: str | None, program: str) -> bushd.aio.Client:
    """By the control socket; where none is named, that of this PC."""
    return await bushd.aio.connect(os.fspath(socket) if socket else None, program=program)
