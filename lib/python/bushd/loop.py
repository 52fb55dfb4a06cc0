"""The asyncio loop of the blocking client, in a thread, and what waits for it."""

from __future__ import annotations

import asyncio
import atexit
import concurrent.futures
import threading
from collections.abc import AsyncIterator, Coroutine, Iterator
from typing import Any, Generic, TypeVar

T = TypeVar("T")


class Loop:
    """An asyncio loop in a thread."""

    def __init__(self) -> None:
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="bushd", daemon=True)
        self._thread.start()
        self.closed = False
        # At the end of the program, as long as the thread still runs: what is ended later would wait for it in vain.
        atexit.register(self.close)

    def run(self, coroutine: Coroutine[Any, Any, T]) -> T:
        """Its result. A signal's exception (Ctrl-C) cancels it, waits until it has ended, and is raised then."""
        if self.closed:
            coroutine.close()
            raise RuntimeError("this client is closed")
        result: concurrent.futures.Future[T] = concurrent.futures.Future()
        tasks: list[asyncio.Task[None]] = []

        async def carry_out() -> None:
            try:
                result.set_result(await coroutine)
            except BaseException as error:
                result.set_exception(error)

        self._loop.call_soon_threadsafe(lambda: tasks.append(self._loop.create_task(carry_out())))
        try:
            return result.result()
        except BaseException:
            if not result.done():
                self._loop.call_soon_threadsafe(lambda: tasks[0].cancel())
                concurrent.futures.wait([result])
            raise

    def call(self, function: Any, *arguments: Any) -> Any:
        async def calls() -> Any:
            return function(*arguments)

        return self.run(calls())

    def iterate(self, values: AsyncIterator[T]) -> Iterator[T]:
        """What comes, as long as it is asked for."""
        try:
            while True:
                yield self.run(anext(values))  # type: ignore[arg-type]  # it is a coroutine
        finally:
            if not self.closed:
                self.run(values.aclose())  # type: ignore[attr-defined]

    def close(self) -> None:
        if self.closed:
            return
        self.closed = True
        atexit.unregister(self.close)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()


class Blocking(Generic[T]):
    """Waits for what one of the classes for asyncio does."""

    def __init__(self, loop: Loop, awaited: T) -> None:
        self._loop = loop
        self._awaited = awaited
