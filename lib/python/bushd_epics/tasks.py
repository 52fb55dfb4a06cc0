"""What this process does at the same time."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any


class Tasks:
    """asyncio forgets a task that nobody holds."""

    def __init__(self) -> None:
        self._under_way: set[asyncio.Task[None]] = set()

    def spawn(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)
        return task

    async def finish(self) -> None:
        """Those that are under way now."""
        if self._under_way:
            await asyncio.wait(set(self._under_way))

    @property
    def any(self) -> bool:
        return bool(self._under_way)


def loop_time() -> float:
    return asyncio.get_running_loop().time()
