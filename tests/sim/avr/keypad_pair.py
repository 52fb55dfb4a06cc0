"""The pulses of the node pair against what the source document says of its keys, by the times of bytes and edges alone.

    keypad_pair.py SIM_AVR_TEST

A byte that ends at t is seen when a tick is prepared, once a tick and within 100 us of its beginning, and counts from the
third such time on; what is prepared is made in the tick after. With ticks of T and delays of the table of FIRST at first
and D at the speed asked for, all to these 100 us:

  - stop, slower, another direction or a broken line let the motor go on as it was until t + 2 T at most; then the running
    step, of the old D, and the ramp-down of at most FIRST end it;
  - a direction begins at a tick's beginning, from t + 3 T to t + 4 T, its first step max(FIRST, D) later; from motion it
    begins at the end of the tick in which the motor has come to rest, if that is later;
  - from then on all steps are D apart.

A step lies in a slot of 20 us, whose interrupt may be late by 5 us: so intervals keep D to 25 us.
"""

import itertools
import sys

import traces

SLOT_NS = 25_000
LOOK_NS = 100_000
FIRST_NS = 4_000_000  # the table's
FORWARD, REVERSE, SLOWER, STOP = 0x00, 0xFF, 0xFE, 0xFD
KEPT_TICKS = 100  # of a key in the test that sets it


def run_of(trace):
    run = {"events": [], "steps": []}
    for word, numbers in trace:
        if word in ("tick", "end"):
            run[word] = numbers[0]
        elif word == "delays":
            run[word] = numbers
        elif word == "step":
            run["steps"].append(tuple(numbers))
        else:
            run["events"].append((numbers[0], word, numbers[1] if len(numbers) > 1 else None))
    return run


def parts(run):
    """(begin, direction, delay) of the times between two events that change something."""
    first, slower, count = run["delays"]

    def delay_ns(times):
        return first + slower * (times % count)

    now, times = 0, 0
    out = [(0, 0, delay_ns(0))]
    last_direction_ns = 0
    for ns, word, byte in run["events"]:
        before = now, times
        if word == "key" and byte == SLOWER:
            times += 1
        elif word == "key" and byte in (FORWARD, REVERSE):
            now = 1 if byte == FORWARD else -1
            last_direction_ns = ns
        elif word == "silent":
            now = 0
            # Forgotten in the first tick that is prepared so long after the last byte.
            ns = last_direction_ns + KEPT_TICKS * run["tick"]
        else:
            now = 0
        if (now, times) != before:
            out.append((ns, now, delay_ns(times)))
    return out + [(run["end"], 0, delay_ns(times))]


def judge(run):
    tick = run["tick"]
    segments, checked = parts(run), 0
    for (_, was, old_ns), (begin, direction, new_ns), (end, *_) in zip(segments, segments[1:], segments[2:]):
        went_on_ns = begin + 2 * tick + old_ns + FIRST_NS + LOOK_NS if was else begin
        latest_begin_ns = max(begin + 4 * tick, went_on_ns + tick) + LOOK_NS
        steps = [(ns, sign) for ns, sign in run["steps"] if begin <= ns < end]
        where = f"{begin} ns: {was} to {direction}, {old_ns} to {new_ns} ns"
        old = [ns for ns, sign in steps if was and ns <= went_on_ns and sign == was]
        if direction == 0:
            assert len(steps) == len(old), f"{where}: {len(steps)} steps, {len(old)} of them in time"
            continue
        first_ns = max(FIRST_NS, new_ns)
        settled = [(ns, sign) for ns, sign in steps if ns > latest_begin_ns + first_ns + SLOT_NS]
        assert settled and all(sign == direction for _, sign in settled), where
        assert settled[0][0] <= latest_begin_ns + first_ns + new_ns + 2 * SLOT_NS, where
        assert end - settled[-1][0] <= new_ns + SLOT_NS, where
        for (a, _), (b, _) in itertools.pairwise(settled):
            assert abs(b - a - new_ns) <= SLOT_NS, f"{where}: {b - a} ns at {b}"
            checked += 1
        # Before: the old motion, a rest, the new one.
        turn = [(ns, sign) for ns, sign in steps if ns <= settled[0][0]]
        fastest = min(old_ns, new_ns)
        for (a, _), (b, _) in itertools.pairwise(turn):
            assert b - a >= fastest - SLOT_NS, f"{where}: {b - a} ns at {b}"
        if was != direction:
            begun = [ns for ns, sign in steps if sign == direction]
            assert begun[0] >= begin + 3 * tick + first_ns - LOOK_NS - SLOT_NS, where
            assert not was or begun[0] > max(old, default=0), where
    return checked


def main(program):
    runs = [run_of(trace) for trace in traces.recorded_by(program, "KeypadPair.*:KeypadSwitchPair.*", "BUSHD_KEYPAD_TRACE")]
    assert len(runs) == 4, f"{len(runs)} traces"
    for run in runs:
        checked = judge(run)
        assert checked > (50 if run["delays"][0] < 10_000_000 else 30), checked
        print(f"{len(run['steps'])} steps, {checked} intervals to {SLOT_NS // 1000} us")
    # The checker sees what is wrong.
    for spoil in (lambda s: s[:200] + s[201:], lambda s: s + [(s[-1][0] + 30_000_000, s[-1][1])],
                  lambda s: [(ns, -sign) for ns, sign in s]):
        try:
            judge(runs[0] | {"steps": spoil(runs[0]["steps"])})
        except AssertionError:
            continue
        raise AssertionError("a wrong trace passed")


if __name__ == "__main__":
    main(sys.argv[1])
