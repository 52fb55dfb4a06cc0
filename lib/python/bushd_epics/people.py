"""A connection to the daemon for each user of Channel Access, so that its history names who has asked for what."""

from __future__ import annotations

import os

import bushd.aio

MOST = 16  # connections; who comes after that takes the place of the one that was used least lately


class People:
    def __init__(self, socket: str | None) -> None:
        self._socket = socket
        self._clients: dict[str, bushd.aio.Client] = {}
        self._at_work: dict[str, int] = {}

    async def client(self, who: str) -> bushd.aio.Client:
        """Raises NoDaemon."""
        client = self._clients.pop(who, None)
        if client is None:
            await self._make_room()
            client = await connect(self._socket, f"epics:{who}")
        self._clients[who] = client  # the last one is the one that was used last
        return client

    def begin(self, who: str) -> None:
        """It must not be closed until `end`: that would end its jogs."""
        self._at_work[who] = self._at_work.get(who, 0) + 1

    def end(self, who: str) -> None:
        self._at_work[who] -= 1

    async def close(self) -> None:
        clients, self._clients = list(self._clients.values()), {}
        for client in clients:
            await client.close()

    async def _make_room(self) -> None:
        idle = [who for who in self._clients if not self._at_work.get(who)]
        for who in idle[: len(self._clients) - MOST + 1]:
            await self._clients.pop(who).close()


async def connect(socket: str | None, program: str) -> bushd.aio.Client:
    """By the control socket; where none is named, that of this PC."""
    return await bushd.aio.connect(os.fspath(socket) if socket else None, program=program)
