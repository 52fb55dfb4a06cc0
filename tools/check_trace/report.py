"""The figures, for people and as JSON."""

import json

from check_trace.motion import FIRST_TICK, INTERIOR, LAST_TICK


def largest_us(errors_ns):
    """None if there are none: no edge is something else than no error."""
    return round(max(map(abs, errors_ns)) / 1000, 1) if errors_ns else None


def text_us(error_us):
    return "(no edges)" if error_us is None else f"{error_us} us"


def figures(motors, trace, skew_ns, on_paths):
    every = [[error for motor in motors for error in motor.errors_ns[place]] for place in range(3)]
    interior = every[INTERIOR]
    return {
        "motors": len(motors),
        "mcus": len({motor.mcu for motor in motors}),
        "steps_commanded": sum(len(motor.steps) for motor in motors),
        "steps_made": sum(map(len, trace.edges.values())),
        "steps_of_their_own": sum(motor.others for motor in motors),
        "steps_on_paths": on_paths,
        "max_edge_error_us": largest_us(interior) or 0.0,
        "rms_edge_error_us": round((sum(e * e for e in interior) / max(1, len(interior))) ** 0.5 / 1000, 1),
        "max_first_tick_error_us": largest_us(every[FIRST_TICK]),
        "max_last_tick_error_us": largest_us(every[LAST_TICK]),
        "max_bound_share": round(max((motor.bound_share for motor in motors), default=0), 3),
        "max_off_slot_us": round(max((motor.off_slot_ns for motor in motors), default=0) / 1000, 3),
        "max_skew_us": round(skew_ns / 1000, 3),
    }


def rows(motors):
    for motor in motors:
        yield {
            "motor": motor.name,
            "mcu": motor.mcu,
            "output": motor.output,
            "moves": len(motor.moves),
            "commanded": len(motor.steps),
            "made": len(motor.edges),
            "max_us": largest_us(motor.errors_ns[INTERIOR]),
            "first_us": largest_us(motor.errors_ns[FIRST_TICK]),
            "last_us": largest_us(motor.errors_ns[LAST_TICK]),
        }


def print_rows(motors):
    all_rows = list(rows(motors))
    if not all_rows:
        return
    names = list(all_rows[0])
    cells = [names] + [["-" if row[name] is None else str(row[name]) for name in names] for row in all_rows]
    widths = [max(map(len, column)) for column in zip(*cells)]
    for row in cells:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip())


def print_report(motors, clocks, problems, total, verbose):
    if verbose:
        print_rows(motors)
        for address, clock in sorted(clocks.items()):
            print(f"mcu{address}: tick 0 at {clock.at(0) / 1e6:.6f} ms, rate {clock.rate * 1e6:+.3f} ppm")
    for line in problems.lines():
        print(f"problem: {line}")
    if any(motor.path_edges for motor in motors):
        on_paths = [len(edges) for motor in motors for edges in motor.path_edges.values()]
        movers = sum(1 for motor in motors if motor.path_edges)
        print(f"{total['steps_on_paths']} of {sum(on_paths)} edges of {movers} motors are judged by the path")
        if not total["steps_commanded"]:
            return
    print(
        f"max error in a move's first tick {text_us(total['max_first_tick_error_us'])}, in its last tick "
        f"{text_us(total['max_last_tick_error_us'])}; rms in all others {total['rms_edge_error_us']} us"
    )
    print(
        f"largest share of the error that interpolation within a tick may make: "
        f"{100 * total['max_bound_share']:.0f} %"
    )
    print(
        f"farthest from the exact slot {total['max_off_slot_us']} us; largest skew between MCUs "
        f"{total['max_skew_us']} us"
    )
    if total["steps_of_their_own"]:
        print(f"{total['steps_of_their_own']} steps of homing, of local inputs and of ramps at limit switches")
    print(
        f"{total['motors']} motors, {total['mcus']} MCUs, {total['steps_commanded']} steps commanded, "
        f"{total['steps_made']} steps made, max edge error {total['max_edge_error_us']} us"
    )


def print_json(motors, problems, total):
    report = {"good": problems.none(), **total}
    report["per_motor"] = list(rows(motors))
    report["problems"] = list(problems.lines())
    print(json.dumps(report, indent=1))
