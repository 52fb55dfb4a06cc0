import assert from "node:assert/strict";
import { test } from "node:test";
import { rulerOf, sections, stateWords, matcher, type Layout } from "../src/logic/overview";
import { groupsWith, servedRevision } from "../src/logic/table";
import { Lateness } from "../src/model/lateness";
import { Model } from "../src/model/model";
import { Rate } from "../src/model/rates";
import { kKeptS, Ring } from "../src/model/ring";
import type { McuState, MotorDescription, MotorState } from "../src/net/messages";

function motor(name: string, more: Partial<MotorState> = {}): MotorState {
  return {
    name, position_steps: 0, user_position: 0, dial_position: 0, target_steps: 0, user_target: 0,
    velocity_steps_per_s: 0, moving: false, activity: "rest", enabled: true, input: false, inputs: "",
    inhibited: "", trust: "known", uncertain_reason: "", heard_utime_us: null, paused: false,
    held: false, armed_by: "", on_line: false, line_fraction: null, line_left_s: null, ...more,
  };
}

function mcu(name: string, part: number, motors: MotorState[]): McuState {
  return {
    part, bus: "hall", mcu: name, state: "READY", detail: "", inputs: "", program: "", boot_number: 1, tick: 1, motors,
  };
}

function about(name: string, more: Partial<MotorDescription> = {}): MotorDescription {
  return {
    name, output: 0, group: "stage", table: { name: "t", revision: 1, hash: "00000000" },
    description: "", unit: "mm", steps_per_unit: "100", negative: false, offset: 0, precision: 2,
    soft_limits: true, dial_low: -10, dial_high: 10, user_low: -10, user_high: 10, ...more,
  };
}

const state = (daemon: string, utimeMs: number, mcus: McuState[], full = false) => ({
  kind: "state" as const, daemon, utime_us: utimeMs * 1000, full, mcus,
});

test("motors are told apart by daemon and name", () => {
  const model = new Model(() => 0);
  model.takeState(state("a", 1, [mcu("hall:1", 0, [motor("x", { user_position: 1 })])], true));
  model.takeState(state("b", 1, [mcu("hall:1", 0, [motor("x", { user_position: 2 })])], true));
  assert.equal(model.find("a", "x")?.state?.user_position, 1);
  assert.equal(model.find("b", "x")?.state?.user_position, 2);
  assert.equal(model.allMotors().length, 2);
});

test("a later state has only what has changed", () => {
  const model = new Model(() => 0);
  model.takeState(state("a", 1, [mcu("h:1", 0, [motor("x"), motor("y")])], true));
  model.takeChanges();
  model.takeState(state("a", 2, [mcu("h:1", 0, [motor("y", { user_position: 5 })])]));
  const changes = model.takeChanges();
  assert.deepEqual([...changes.motors].map((one) => one.name), ["y"]);
  assert.equal(changes.structure, false);
  assert.equal(model.find("a", "x")?.state?.user_position, 0);
  assert.equal(model.allMotors().length, 2);
});

test("what is not in a full state is gone", () => {
  const model = new Model(() => 0);
  model.takeState(state("a", 1, [mcu("h:1", 0, [motor("x"), motor("y")]), mcu("h:2", 1, [motor("z")])], true));
  model.takeState(state("a", 2, [mcu("h:1", 0, [motor("y")])], true));
  assert.deepEqual(model.allMotors().map((one) => one.name), ["y"]);
  assert.equal(model.find("a", "x"), undefined);
});

const described = (daemon: string, mcu: string, motors: MotorDescription[], full = false) => ({
  kind: "description" as const, daemon, full, mcus: [
    { part: 0, bus: "hall", mcu, address: 1, tick_ns: 1, emergency_stop: "ramp", port: "", motors }],
});

test("a motor is the same object after its daemon has been started again, and is told of anew", () => {
  let ms = 0;
  const model = new Model(() => ms);
  model.takeDescription(described("a", "h:1", [about("x"), about("y")], true));
  model.takeState(state("a", 0, [mcu("h:1", 0, [motor("x", { user_position: 1 }), motor("y")])], true));
  const x = model.find("a", "x");
  assert.ok(x?.there);
  const before = x.mcu;
  ms = 5000;
  // What the daemon says of itself comes before the states of its MCUs.
  model.takeDescription(described("a", "h:1", [about("x", { unit: "deg" })], true));
  model.takeState(state("a", 5000, [], true));
  assert.equal(model.find("a", "x"), undefined);
  assert.deepEqual(model.allMotors(), []);
  assert.equal(x.there, false);
  assert.ok(model.isOldMotor(x));
  model.takeChanges();
  ms = 5100;
  model.takeState(state("a", 5100, [mcu("h:1", 0, [motor("x", { user_position: 2 })])]));
  assert.equal(model.find("a", "x"), x);
  assert.equal(x.mcu, before);
  assert.deepEqual(model.allMotors(), [x]);
  assert.deepEqual([x.there, x.state?.user_position, x.about?.unit], [true, 2, "deg"]);
  assert.equal(model.isOldMotor(x), false);
  const changes = model.takeChanges();
  assert.ok(changes.structure && changes.motors.has(x) && changes.mcus.has(before));
});

test("what a motor did before it was gone is not shown as what it does now", () => {
  const model = new Model(() => 0);
  model.takeState(state("a", 0, [mcu("h:1", 0, [motor("x", { user_position: 1 })])], true));
  const x = model.find("a", "x");
  assert.ok(x);
  model.takeState(state("a", 0, [mcu("h:1", 0, [])], true));
  // Its MCU is heard, and the motor is not among those that it has.
  assert.equal(model.isOld(x.mcu), false);
  assert.ok(model.isOldMotor(x));
  assert.equal(x.state?.user_position, 1);
  model.takeDescription(described("a", "h:1", [about("x")]));
  assert.equal(model.find("a", "x"), x);
  assert.equal(x.state, undefined);
});

test("motors of a daemon that bushd-web has no more are the same when it has it again", () => {
  const hello = (daemons: string[]) => ({
    kind: "hello" as const, version: "1", user: null, may_command: true, may_stop: true, daemons,
  });
  const model = new Model(() => 0);
  model.takeHello(hello(["a"]));
  model.takeState(state("a", 0, [mcu("h:1", 0, [motor("x")])], true));
  const x = model.find("a", "x");
  assert.ok(x);
  model.takeHello(hello([]));
  assert.ok(model.isOldMotor(x));
  model.takeHello(hello(["a"]));
  model.takeState(state("a", 0, [mcu("h:2", 0, [motor("x")])], true));
  assert.equal(model.find("a", "x"), x);
  assert.equal(x.mcu.name, "h:2");
  assert.deepEqual(model.allMotors(), [x]);
  assert.equal(model.isOldMotor(x), false);
});

test("groups with a table are those of now", () => {
  const model = lab();
  const groups = (table: string): string[] => groupsWith(model.allMotors(), table);
  assert.deepEqual([groups("t"), groups("own")], [["stage", "slits"], []]);
  const own = { name: "own", revision: 2, hash: "00000001" };
  model.takeDescription(described("a", "h:1", [about("m10", { table: own }), about("m2", { table: own })]));
  assert.deepEqual([groups("t"), groups("own")], [["slits"], ["stage"]]);
  model.takeDescription(described("a", "h:1", [about("m10", { group: "" })]));
  assert.deepEqual(groups("own"), ["stage"]);
});

test("the revision in service is that of the group, else of any that has the table", () => {
  const model = lab();
  const served = (table: string, group: string): number | undefined =>
    servedRevision(model.allMotors(), table, group);
  const own = (revision: number): MotorDescription["table"] => ({ name: "own", revision, hash: "00000001" });
  assert.deepEqual([served("t", "stage"), served("own", "stage")], [1, undefined]);
  const slits = about("m2", { group: "slits", table: own(3) });
  model.takeDescription(described("a", "h:1", [about("m10", { table: own(2) }), slits]));
  assert.deepEqual([served("own", "stage"), served("own", "slits"), served("own", "nobody")], [2, 3, 2]);
  // One that is in no file of tables has no revision.
  model.takeDescription(described("a", "h:1", [about("m10", { table: own(0) })]));
  assert.equal(served("own", "stage"), 3);
});

test("a motor that is at another MCU by now is there once", () => {
  const model = new Model(() => 0);
  model.takeState(state("a", 1, [mcu("h:1", 0, [motor("x")])], true));
  model.takeState(state("a", 2, [mcu("h:2", 0, [motor("x")])], true));
  assert.deepEqual(model.allMotors().map((one) => one.mcu.name), ["h:2"]);
});

test("an MCU is old 1 s after it was heard, whatever others do", () => {
  let ms = 0;
  const model = new Model(() => ms);
  model.takeState(state("a", 0, [mcu("h:1", 0, [motor("x")]), mcu("h:2", 1, [motor("y")])], true));
  ms = 1000;
  model.takeState(state("a", 1000, [mcu("h:2", 1, [])]));
  const [one, two] = model.allMcus();
  assert.ok(one && two);
  assert.equal(model.isOld(one), false);
  ms = 1001;
  assert.equal(model.isOld(one), true);
  assert.equal(model.isOld(two), false);
  assert.equal(model.ageMs(one), 1001);
});

test("states that waited somewhere are as old as they are", () => {
  let ms = 0;
  const model = new Model(() => ms);
  for (; ms < 1000; ms += 100) model.takeState(state("a", 5000 + ms, [mcu("h:1", 0, [motor("x")])]));
  ms = 9000; // the page was suspended; what was sent meanwhile comes now
  model.takeState(state("a", 6000, [mcu("h:1", 0, [motor("x", { user_position: 1 })])]));
  const [one] = model.allMcus();
  assert.ok(one && model.isOld(one));
  model.takeState(state("a", 14_000, [mcu("h:1", 0, [motor("x", { user_position: 2 })])]));
  assert.ok(!model.isOld(one));
});

test("a clock that is set back or forward makes nothing old", () => {
  const lateness = new Lateness();
  let ms = 0;
  for (const jumpMs of [0, -3.6e6, 3.6e6, 86.4e6, -86.4e6]) {
    for (let i = 0; i < 10; ++i, ms += 100) {
      assert.equal(lateness.of(1e9 + jumpMs + ms, ms) < 200, true);
    }
  }
});

test("clocks that drift apart make nothing old", () => {
  const lateness = new Lateness();
  for (let ms = 0; ms < 36e5; ms += 100) {
    assert.ok(lateness.of(ms * 0.9995, ms) < 1);
  }
});

test("errors a second are those of the last ten seconds", () => {
  const rate = new Rate();
  assert.equal(rate.perSecond(), undefined);
  for (let s = 0; s <= 30; ++s) rate.take(s < 15 ? 0 : (s - 15) * 3, s * 1000);
  assert.equal(rate.perSecond(), 3);
  rate.take(0, 31_000); // the daemon was started again
  assert.equal(rate.perSecond(), undefined);
  rate.take(1, 32_000);
  assert.equal(rate.perSecond(), 1);
});

test("a ring keeps ten minutes, and its room", () => {
  const ring = new Ring(100_000);
  for (let i = 0; i <= 7000; ++i) ring.push({ atS: i / 10, position: i, target: i, speed: 1 });
  const [times] = ring.columns();
  assert.equal(times[times.length - 1], 700);
  assert.equal(times[0], 700 - kKeptS);
  const small = new Ring(10);
  for (let i = 0; i < 25; ++i) small.push({ atS: i, position: i, target: 0, speed: 0 });
  assert.deepEqual(small.columns()[0], [15, 16, 17, 18, 19, 20, 21, 22, 23, 24]);
});

test("a gap in reports is a gap in the ring, and nothing goes back in time", () => {
  const ring = new Ring();
  ring.push({ atS: 1, position: 1, target: NaN, speed: 0 });
  ring.push({ atS: 3, position: 2, target: 2, speed: 0 });
  ring.push({ atS: 2, position: 9, target: 9, speed: 0 });
  const [times, positions, targets] = ring.columns();
  assert.deepEqual(times, [1, 1.6, 3]);
  assert.deepEqual(positions, [1, null, 2]);
  assert.deepEqual(targets, [null, null, 2]);
});

const kLayout: Layout = { grouping: "group", sorting: "config", filter: "", onlyFavourites: false, favourites: [] };

function lab(): Model {
  const model = new Model(() => 0);
  model.takeState(state("a", 1, [
    mcu("h:1", 0, [motor("m10"), motor("m2", { moving: true }), motor("slit")]),
    mcu("h:2", 1, [motor("chi", { trust: "uncertain" })]),
  ], true));
  model.takeDescription({ kind: "description", daemon: "a", full: true, mcus: [
    { part: 0, bus: "hall", mcu: "h:1", address: 1, tick_ns: 1, emergency_stop: "ramp", port: "", motors: [
      about("m10"), about("m2"), about("slit", { group: "slits", description: "Upper jaw" })] },
    { part: 1, bus: "hall", mcu: "h:2", address: 2, tick_ns: 1, emergency_stop: "ramp", port: "", motors: [
      about("chi", { group: "slits" })] },
  ] });
  return model;
}

const shown = (layout: Partial<Layout>): [string, string[]][] =>
  sections(lab().allMotors(), { ...kLayout, ...layout }, false)
    .map((section) => [section.title, section.motors.map((one) => one.name)]);

test("motors are grouped, sorted and filtered", () => {
  assert.deepEqual(shown({}), [["group stage", ["m10", "m2"]], ["group slits", ["slit", "chi"]]]);
  assert.deepEqual(shown({ grouping: "mcu", sorting: "name" }),
    [["MCU h:1", ["m2", "m10", "slit"]], ["MCU h:2", ["chi"]]]);
  assert.deepEqual(shown({ grouping: "none", sorting: "state" }), [["", ["chi", "m2", "m10", "slit"]]]);
  assert.deepEqual(shown({ filter: "m*", grouping: "none" }), [["", ["m10", "m2"]]]);
  assert.deepEqual(shown({ filter: "m[1-4]" , grouping: "none" }), [["", ["m2"]]]);
  assert.deepEqual(shown({ filter: "@slits JAW", grouping: "none" }), [["", ["slit"]]]);
  assert.deepEqual(shown({ filter: "m[", grouping: "none" }), []);
  assert.deepEqual(shown({ onlyFavourites: true, favourites: ['["a","chi"]'] }), [["group slits", ["chi"]]]);
});

test("a filter takes dots and brackets as they are", () => {
  const [one] = lab().allMotors();
  assert.ok(one);
  assert.equal(matcher("m.0*")(one), false);
  assert.equal(matcher("m1?")(one), true);
});

test("the ruler shows where a motor stands between its limits", () => {
  const model = lab();
  const one = model.find("a", "m2");
  assert.ok(one?.state && one.about);
  one.state = motor("m2", { user_position: 5, user_target: 10, moving: true });
  assert.deepEqual(rulerOf(one), { low: -10, high: 10, at: 0.75, target: 1, beyond: false });
  one.state = motor("m2", { user_position: -12 });
  assert.deepEqual(rulerOf(one), { low: -10, high: 10, at: 0, target: undefined, beyond: true });
  one.about = about("m2", { soft_limits: false, user_low: null, user_high: null });
  assert.equal(rulerOf(one), undefined);
});

test("the state of a motor in words", () => {
  const one = lab().find("a", "m2");
  assert.ok(one);
  one.state = motor("m2", { moving: true, activity: "home" });
  assert.deepEqual(stateWords(one), ["homing"]);
  one.state = motor("m2", { moving: true, on_line: true, line_fraction: 0.424, held: true, enabled: false });
  assert.deepEqual(stateWords(one), ["moving", "held", "line 42 %", "drivers off"]);
});
