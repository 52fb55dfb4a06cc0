"""One connection that the devices of a framework share: what is set together starts together, by one request.

A framework sets motors one by one, and then waits for all of them. `Daemon` collects what is set without a pause between and asks
for it as one move, so that motors of one bus start in the same tick. It needs no framework; `bushd.ophyd_async` is made of it.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping

from . import aio, arguments, model
from .errors import BushdError, MoveFailed
from .links import DEFAULT_PREFIX
from .model import Outcome, Trust
from .motion import Motion

# A framework's engine runs a few turns of the loop between one motor and the next. Time is not looked at: a slow PC has slow turns.
QUIET_TURNS = 16
# Positions that are asked for between two motors (of relative moves) keep a step open, but not without an end.
READING_KEEPS_OPEN_S = 1.0
PROGRESS_EVERY_S = 0.1
# Devices are read one after the other, each with all that the daemon says. So long what it has said counts, unless this program moves something.
FRESH_S = 0.02

Begin = Callable[[aio.Client], Awaitable[Motion]]


class UntrustedPosition(BushdError):
    """A motor's position is not known, so it is neither shown nor counted on."""


def trusted(motor: model.Motor, uncertain: bool = False) -> model.Motor:
    """The motor, whose position may be counted on. Raises UntrustedPosition.

    uncertain: one that is uncertain, but counted by an MCU that is online, does as well.
    """
    if motor.trust is Trust.UNCERTAIN and not uncertain:
        why = motor.uncertain_reason or "nobody has said where it stands"
        raise UntrustedPosition(
            f"{motor.name}: its position is uncertain: {why}. Home it, or say where it stands ('bushctl set', 'bushctl confirm')"
        )
    if motor.trust is Trust.UNKNOWN:
        raise UntrustedPosition(f"{motor.name}: its position is unknown: MCU {motor.mcu} has not reported since it booted")
    if motor.trust is Trust.STALE:
        raise UntrustedPosition(f"{motor.name}: its position is stale: MCU {motor.mcu} is offline since {motor.heard_at}")
    return motor


class Step:
    """Motors that start together, and what becomes of them. Made by `Daemon`."""

    def __init__(self, targets: Mapping[str, float], begin: Begin | None, uncertain: Iterable[str]) -> None:
        self.targets = dict(targets)
        self.begin = begin  # None: a move to the targets
        self.uncertain = set(uncertain)
        self.before: dict[str, model.Motor] = {}  # when it began
        self.motion: Motion | None = None  # once the daemon has accepted it
        self.task: asyncio.Task[model.MoveResult | None]  # None: it was stopped before it began
        self.changes = 0
        self.closed = begin is not None  # no motor is added
        self.stopping: set[str] = set()  # before the daemon has accepted it
        self.never_began: set[str] = set()
        self.pardoned = False  # stopped by who knows that no target was reached
        self.accepted = asyncio.Event()  # or over

    def check(self, name: str) -> None:
        """For one that is over: raises what has become of this motor, unless it stands at its target."""
        result = self.task.result()
        if result is None or name in self.never_began:
            result = model.MoveResult(Outcome.STOPPED, f"{name}: stopped before it began")
            outcome = result.outcome
        else:
            outcome = result[name].outcome
        if not (outcome.succeeded or (outcome is Outcome.STOPPED and self.pardoned)):
            raise MoveFailed(result)


class Daemon:
    """The daemon of some devices. Of one asyncio loop at a time; it connects when it is used, and again after the daemon was restarted.

    Arguments are those of `bushd.aio.connect()`.
    """

    def __init__(
        self,
        socket: str | os.PathLike[str] | None = None,
        *,
        lcm: bool | str = False,
        prefix: str = DEFAULT_PREFIX,
        program: str | None = None,
    ) -> None:
        def opens() -> aio.Connecting:
            return aio.connect(socket, lcm=lcm, prefix=prefix, program=program)

        self._opens = opens
        self._client: aio.Client | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._connecting = asyncio.Lock()
        self._gathering: Step | None = None
        self._steps: set[Step] = set()
        self._reading = 0
        self._moved = 0  # so many times something has begun, ended or was stopped
        self._heard: tuple[float, int, model.Status] | None = None  # when it was asked for, and what had moved by then
        self._progress: tuple[float, asyncio.Task[model.Status]] | None = None

    async def client(self) -> aio.Client:
        """The connected client. Raises NoDaemon."""
        loop = asyncio.get_running_loop()
        if self._loop is not loop:
            self._loop, self._client, self._connecting = loop, None, asyncio.Lock()
        async with self._connecting:
            if self._client is None or not self._client.connected:
                if self._client is not None:
                    await self._client.close()
                self._client = None
                self._moved += 1
                self._client = await self._opens()
            return self._client

    async def close(self) -> None:
        if self._client is not None:
            await self._client.close()
            self._client = None

    async def status(self) -> model.Status:
        """All motors as they are now: no older than FRESH_S, and than whatever this program has begun or what has ended since."""
        now, moved, client = asyncio.get_running_loop().time(), self._moved, await self.client()
        if self._heard is not None and self._heard[1] == moved and now - self._heard[0] < FRESH_S:
            return self._heard[2]
        self._reading += 1
        try:
            status = await client.status()
        finally:
            self._reading -= 1
        self._heard = now, moved, status
        return status

    async def motor(self, name: str) -> model.Motor:
        """Raises UnknownMotor."""
        return arguments.find(await self.status(), name)

    # -- motion

    def set(self, targets: Mapping[str, float], uncertain: bool = False) -> Step:
        """Lets motors and pseudo-axes move to these positions, together with those that are set before the loop comes to rest."""
        step = self._gathering
        if step is None or step.closed or not step.targets.keys().isdisjoint(targets):
            if step is not None:
                step.closed = True  # a motor is set once more: that is another step
            step = self._gathering = self._start(Step({}, None, ()))
        step.targets.update(targets)
        step.uncertain.update(targets if uncertain else ())
        step.changes += 1
        return step

    def begin(self, targets: Mapping[str, float], begin: Begin, uncertain: bool = False) -> Step:
        """The same for a motion of another kind, on its own. targets: where its motors will stand in the end."""
        return self._start(Step(targets, begin, targets if uncertain else ()))

    async def progress(self, step: Step, *names: str, timeout_s: float | None = None) -> AsyncIterator[model.Motor]:
        """The first of these motors as it moves, until all of the step stand. Raises what has become of one of them.

        timeout_s: then they are stopped, and TimeoutError is raised. Cancelled, it ramps them down.
        """
        loop = asyncio.get_running_loop()
        give_up = None if timeout_s is None else loop.time() + timeout_s
        try:
            while not step.task.done():
                left = PROGRESS_EVERY_S if give_up is None else min(PROGRESS_EVERY_S, give_up - loop.time())
                if left <= 0:
                    await self.stop(*names)
                    raise TimeoutError(f"{', '.join(names)}: not at the target after {timeout_s:g} s, and stopped")
                done, _ = await asyncio.wait({step.task}, timeout=left)
                if not done and step.motion is not None:
                    try:
                        yield arguments.find(await self._seen(), names[0])
                    except BushdError:
                        pass  # what has become of the motion is told by its own answer
        except (asyncio.CancelledError, GeneratorExit):
            await self.stop(*names)
            raise
        for name in names:
            step.check(name)

    async def stop(self, *names: str) -> None:
        """Ramps these motors down, whoever moves them. Returns once they stand; of motors at rest it is nothing."""
        for step in self._steps:
            step.stopping.update(step.targets.keys() & set(names))
        await self._stop(names)

    async def stop_own(self, *names: str) -> None:
        """Ramps down what this program has begun with one of these motors, all motors of a step at once. No failure for who waits for it."""
        steps = [step for step in self._steps if not step.targets.keys().isdisjoint(names)]
        for step in steps:
            step.pardoned = step.closed = True
            step.stopping.update(step.targets)
        moving = {name for step in steps if step.motion is not None for name in step.targets}
        if moving:
            await self._stop(sorted(moving))
        if steps:
            await asyncio.wait([step.task for step in steps])

    async def _stop(self, names: Iterable[str]) -> None:
        client = await self.client()
        self._moved += 1
        await client.stop(*names, check=False)
        self._moved += 1

    def _start(self, step: Step) -> Step:
        step.task = asyncio.create_task(self._carry_out(step))
        self._steps.add(step)
        step.task.add_done_callback(lambda _: self._over(step))
        return step

    def _over(self, step: Step) -> None:
        self._steps.discard(step)
        self._moved += 1
        step.accepted.set()
        if not step.task.cancelled():
            step.task.exception()  # it is told to who waits; nobody may

    async def _carry_out(self, step: Step) -> model.MoveResult | None:
        await self._until_quiet(step)
        step.closed = True
        client, status = await self.client(), await self.status()
        for name in step.targets:
            step.before[name] = trusted(arguments.find(status, name), name in step.uncertain)
        step.never_began = set(step.targets) if step.begin is not None and step.stopping else set(step.stopping)
        targets = {name: target for name, target in step.targets.items() if name not in step.never_began}
        if not targets:
            return None
        step.stopping.clear()
        self._moved += 1
        step.motion = await (client.move(targets, wait=False) if step.begin is None else step.begin(client))
        step.accepted.set()
        if step.stopping:  # meanwhile: what was sent to stop them may have overtaken the move
            await client.stop(*sorted(step.stopping), check=False)
        return await step.motion.wait(check=False)

    async def _until_quiet(self, step: Step) -> None:
        loop = asyncio.get_running_loop()
        give_up = loop.time() + READING_KEEPS_OPEN_S
        quiet = 0
        while quiet < QUIET_TURNS and not step.closed:
            seen = step.changes
            await asyncio.sleep(0)
            is_open = step.changes != seen or (self._reading > 0 and loop.time() < give_up)
            quiet = 0 if is_open else quiet + 1

    async def _seen(self) -> model.Status:
        """As all motors were a moment ago, for all that show how far they are."""
        now = asyncio.get_running_loop().time()
        if self._progress is None or now - self._progress[0] > PROGRESS_EVERY_S / 2:
            self._progress = now, asyncio.create_task(self._status_for_progress())
        return await asyncio.shield(self._progress[1])

    async def _status_for_progress(self) -> model.Status:
        return await (await self.client()).status()
