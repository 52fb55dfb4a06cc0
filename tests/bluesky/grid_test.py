"""A grid of four motors, point by point: none is off, none is done that is not, and what Bluesky and the devices take beside the motion is printed.

$BUSHD_GRID_SIDE is the number of points of each motor: 3 by default (81 points), 10 in the nightly test (10^4)."""

import os
import time

from lab import TABLE_RUNS, BlueskyTest, main, without_repeats

SIDE = int(os.environ.get("BUSHD_GRID_SIDE", "3"))
STEPS = 2  # from point to point
NAMES = ("a0", "a2", "b0", "b3")


class Grid(BlueskyTest):
    def test_no_point_of_a_grid_of_four_motors_is_off(self):
        import bluesky.plans as bp

        self.bring_up_lab(bus_lines=TABLE_RUNS)
        last = STEPS * (SIDE - 1)
        by_motor = [word for motor in self.motors_of(*NAMES) for word in (motor, 0, last, SIDE)]
        values = range(0, last + 1, STEPS)
        points = [(a, b, c, d) for a in values for b in values for c in values for d in values]
        alone = [*points[: SIDE**3], points[0]]
        alone_s = self.in_loop(self.moves_alone, alone)
        began_s = time.monotonic()
        try:
            self.engine(bp.grid_scan([], *by_motor))
        finally:
            # Also where a plan fails, on a PC that was held up: what it has read until then is right.
            read = self.read(*NAMES)
            self.assertEqual(read, points[: len(read)])
            print(f"{len(read)} points were read", flush=True)
        each_s = (time.monotonic() - began_s) / len(points)

        self.assertEqual(len(read), len(points))
        self.end_programs()
        self.assertEqual(self.rests_in_trace(*NAMES), without_repeats([*alone, *points]))
        self.assert_started_together()
        print(f"{len(points)} points of {len(NAMES)} motors: {1000 * each_s:.1f} ms each; moved by the client alone "
              f"{1000 * alone_s:.1f} ms; beside the motion {1000 * (each_s - alone_s):.1f} ms", flush=True)

    async def moves_alone(self, points):
        client = await self.daemon.client()
        began_s = time.monotonic()
        for point in points:
            await client.move(dict(zip(NAMES, point)), unit="steps")
        return (time.monotonic() - began_s) / len(points)


if __name__ == "__main__":
    main()
