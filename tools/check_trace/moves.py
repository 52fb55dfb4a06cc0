"""The daemon's log of moves (docs/move-log.md)."""

import json
import math
from collections import defaultdict

from check_trace.trajectories import Trajectory, TrajectoryMove
from check_trace.elementary import ElementaryMove, ElementaryPart, Order
from check_trace.lines import Envelope, LineMove, Part
from check_trace.motion import ENDINGS, Move
from check_trace.problems import InputError
from check_trace.tables import Tables
from check_trace.trace import Levels


class Autonomous:
    """Motion by homing or local inputs: the log tells when, and where from and to, but not its steps."""

    def __init__(self, event):
        self.what = event["what"]
        self.begin_tick = event.get("from_tick", -math.inf)
        self.end_tick = event["until_tick"] + 1
        self.begin_ns = self.begin_tick * event["tick_ns"]
        self.end_ns = self.end_tick * event["tick_ns"]
        self.from_steps = event["from_steps"]
        self.position_steps = event["position_steps"]
        self.sets = event["set"]  # the position is not that to which its steps lead
        self.travelled = 0


class Motor:
    def __init__(self, name, bus, address, output):
        self.name = name
        self.bus = bus
        self.address = address
        self.output = output
        self.mcu = f"{bus}:{address}"
        self.moves = []
        self.autonomous = []
        self.from_steps = None  # before the first of both
        self.set_by_steps = 0  # sum of what "set" has shifted the position by, without a step
        self.steps = []
        self.edges = []
        self.path_edges = defaultdict(list)  # by number of the path
        self.others = 0  # edges of homing, local motion, and on the MCU's own way to rest
        self.errors_ns = ([], [], [])  # of the edges against the table, by place in the move
        self.off_slot_ns = 0  # farthest from the exact slot
        self.bound_share = 0.0  # largest error as a part of what it may be

    def place(self):
        return self.bus, self.address, self.output

    def __str__(self):
        return f"{self.name} ({self.mcu}, output {self.output})"

    def travelled(self):
        return sum(1 if edge.direction else -1 for edge in self.edges)

    def steps_by_move(self):
        """By id() of each."""
        by_move = defaultdict(list)
        for step in self.steps:
            by_move[id(step.move)].append(step)
        return by_move


class PathMove(Move):
    """A motor's part of a run along a path, whose steps are judged by the path (paths.py)."""

    def __init__(self, event, table):
        super().__init__({**event, "steps": 0}, table)
        self.way = event["path"]["way"]
        self.goal_steps = self.from_steps + event["steps"]

    def end_steps(self):
        """Where its path has led is judged by that."""
        return self.result_steps

    def change(self, tick, target_steps=None, shortest_delay=0, run_steps=None):
        pass


class MoveLog:
    def __init__(self, bus, problems):
        self.motors = {}  # by name
        self._bus = bus
        self._problems = problems
        self._moves = {}  # by motor and id: a group move has one id
        self._at_steps = {}  # by motor name: where the last result or "set" leaves it
        self._tables = Tables()
        self._ways = {}  # by number: the tables of lines
        self._orders = {}  # by number: of lines by the elementary law
        self._trajectories = {}  # by number
        self._ticks = set()  # (bus, tick_ns)
        self.paths = {}  # by number of the way: shortest delays by motor's name
        self.levels = {}  # by address: which outputs are active low

    def _levels_told(self, event):
        if event["bus"] == self._bus or self._bus is None:
            low = (frozenset(event[key]) for key in ("step_low", "direction_low"))
            self.levels[event["address"]] = Levels(event["enable_low"], *low)

    def read(self, path):
        take = {
            "request": lambda event: None,  # who has asked for it
            "requests": lambda event: None,  # how many more
            "levels": self._levels_told,
            "table": self._tables.told,
            "line": self._line,
            "path": self._path,
            "trajectory": self._trajectory,
            "move": self._move,
            "stop": self._change,
            "retarget": self._change,
            "result": self._result,
            "set": self._set,
            "offset": lambda event: None,  # user positions only
            "config": lambda event: None,
            "corrected": self._corrected,
            "restarted": self._set,  # the MCU counts from anew
            "autonomous": self._autonomous,
        }
        try:
            with open(path, encoding="utf-8") as file:
                for number, line in enumerate(file, 1):
                    try:
                        event = json.loads(line)
                        take[event["event"]](event)
                    except (ValueError, KeyError, TypeError) as error:
                        raise InputError(f"{path}:{number}: not an event: {error!r}") from None
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        if len(self._ticks) > 1:
            raise InputError(f"{path}: moves on several buses or ticks; choose one with --bus NAME")

    def tick_ns(self):
        return next(iter(self._ticks))[1]

    def _motor_of(self, event, what):
        """None: it is on a bus that is not asked for."""
        if self._bus is not None and event["bus"] != self._bus:
            return None
        self._ticks.add((event["bus"], event["tick_ns"]))
        name = event["motor"]
        place = (event["bus"], event["address"], event["output"])
        motor = self.motors.setdefault(name, Motor(name, *place))
        if motor.place() != place:
            self._problems.add(motor, "output", f"{what} is on another output: {place}")
        from_steps = event["from_steps"]
        if motor.from_steps is None:
            motor.from_steps = from_steps
        before_steps = self._at_steps.get(name, from_steps)
        if from_steps != before_steps:
            text = f"{what} starts from {from_steps} steps, the one before ends at {before_steps}"
            self._problems.add(motor, "position", text)
        return motor

    def _autonomous(self, event):
        motor = self._motor_of(event, event["what"])
        if motor is not None:
            motor.autonomous.append(Autonomous(event))
            self._at_steps[motor.name] = event["position_steps"]

    def _move(self, event):
        motor = self._motor_of(event, f"move {event['id']}")
        if motor is None:
            return
        table = self._tables.of(event)
        if "path" in event:
            move = PathMove(event, table)
        elif "line" in event and event["line"]["way"] in self._orders:
            way = event["line"]["way"]
            move = ElementaryMove(event, table, self._ways[way], self._orders[way])
        elif "line" in event:
            move = LineMove(event, table, self._ways[event["line"]["way"]])
        elif "trajectory" in event:
            move = TrajectoryMove(event, table, self._trajectories[event["trajectory"]["trajectory"]])
        else:
            move = Move(event, table)
        motor.moves.append(move)
        self._moves[motor.name, move.id] = move

    def _line(self, event):
        """A way of a line: the table of its runs."""
        longest = event["longest"]
        if event.get("law") == "elementary":
            order = Order({motor["output"]: motor["increment"] for motor in event["motors"]})
            self._orders[event["way"]] = order
            parts = [
                ElementaryPart(self._tables.of(motor), motor["increment"], longest, motor["shortest_delay"], order, motor["output"])
                for motor in event["motors"]
            ]
            self._ways[event["way"]] = Envelope(parts)
            return
        parts = [Part(self._tables.of(motor), motor["increment"], longest, motor["shortest_delay"]) for motor in event["motors"]]
        self._ways[event["way"]] = Envelope(parts)

    def _path(self, event):
        self.paths[event["way"]] = {motor["motor"]: motor["shortest_delay"] for motor in event["motors"]}

    def _trajectory(self, event):
        """The first rows of a trajectory, or further ones."""
        number = event["trajectory"]
        if number in self._trajectories:
            self._trajectories[number].add(event)
        else:
            self._trajectories[number] = Trajectory(event)

    def _change(self, event):
        move = self._moves.get((event["motor"], event["id"]))
        if move is None:
            return
        run_steps = {"run_steps": event["run_steps"]} if "run_steps" in event else {}
        move.change(event["tick"], event.get("target_steps"), event.get("shortest_delay", 0), **run_steps)

    def _result(self, event):
        move = self._moves.get((event["motor"], event["id"]))
        if move is None:
            return
        if move.result is not None:
            motor = self.motors[event["motor"]]
            self._problems.add(motor, "result", f"move {move.id} has more than one result")
        move.result = event["result"]
        if move.result == "late":
            move.change(move.start_tick)  # its first ticks never came: it makes no step
        move.result_steps = event["position_steps"]
        self._at_steps[event["motor"]] = event["position_steps"]

    def _set(self, event):
        name, steps = event["motor"], event["position_steps"]
        if name in self.motors:
            self.motors[name].set_by_steps += steps - self._at_steps.get(name, steps)
        self._at_steps[name] = steps

    def _corrected(self, event):
        """Steps that were made while nobody heard: the edges tell them."""
        self._at_steps[event["motor"]] = event["position_steps"]

    def check(self):
        """What the log must fulfil by itself. Of moves that have not come to their ends as many steps as the motor has edges are
        looked at."""
        outputs = {}
        for motor in self.motors.values():
            other = outputs.setdefault(motor.place(), motor)
            if other is not motor:
                self._problems.add(motor, "output", f"shares its output with {other.name}")
            for move in motor.moves:
                self._check_result(motor, move)
            if motor.moves and motor.moves[-1].result == "turned":
                text = f"move {motor.moves[-1].id} turned, and no move to its target follows"
                self._problems.add(motor, "result", text)
            for before, after in zip(motor.moves, motor.moves[1:]):
                if after.makes_steps() and before.has_ended() and before.runs_at(after.start_tick):
                    text = f"move {after.id} starts in tick {after.start_tick}, in which the one before still runs"
                    self._problems.add(motor, "overlap", text)

    def _check_result(self, motor, move):
        text = None
        if (too_close := move.too_close(max(move.made(), len(motor.edges)) + 1)) is not None:
            name = f"step {too_close} of move {move.id}"
            self._problems.add(motor, "table", f"{name} comes sooner after the one before than its table allows")
        if move.result is None:
            text = f"move {move.id} has no result"
        elif move.result == "limit":
            return  # when the switch was met is not in the log: the edges tell
        elif move.result not in ENDINGS:
            text = f"move {move.id} ended as '{move.result}', so the table does not say what was to happen"
        elif move.result == "reached" and move.end_steps() != move.goal_steps:
            text = f"move {move.id} does not end at its target, and yet its result is 'reached'"
        elif move.result_steps != move.end_steps():
            by_table = move.end_steps()
            text = f"move {move.id} ended at {move.result_steps} steps, by the table it ends at {by_table}"
        if text is not None:
            self._problems.add(motor, "result", text)
