import assert from "node:assert/strict";
import { test } from "node:test";
import { PathSender } from "../src/logic/path_sender";
import { kNotAnswered, StopRound } from "../src/logic/stop_round";
import { Model } from "../src/model/model";
import type { Answer } from "../src/net/requests";

test("a stop that nobody answers within a second says so, until somebody does", () => {
  const round = new StopRound("Stop", ["bushd"], 5000, () => false);
  assert.equal(round.words(5999), "Stop: sent");
  assert.ok(!round.isAlarm(5999));
  assert.ok(round.isAlarm(6000));
  assert.equal(round.words(6000), `Stop: ${kNotAnswered}`);
  round.tell("bushd", "accepted, motors ramp down", true);
  assert.ok(!round.isAlarm(9000));
  assert.equal(round.words(9000), "Stop: accepted, motors ramp down");
});

test("a stop whose connection was lost is not answered, and each daemon is told of", () => {
  const round = new StopRound("Stop", ["a", "b"], 0, () => false);
  round.tell("a", "done (0.10 s)", true);
  round.tell("b", "lost", false);
  assert.ok(!round.isAlarm(999));
  assert.ok(round.isAlarm(1000));
  assert.equal(round.words(1000), `Stop: a: done (0.10 s); b: ${kNotAnswered} (lost)`);
});

test("a daemon that hears none of its MCUs is no answer until it hears one", () => {
  let deaf = true;
  const round = new StopRound("Stop", ["bushd"], 0, () => deaf);
  assert.ok(round.isAlarm(0));
  round.tell("bushd", "accepted", true);
  assert.equal(round.words(10), `Stop: ${kNotAnswered} (accepted)`);
  deaf = false;
  assert.ok(!round.isAlarm(20));
  deaf = true;
  assert.ok(!round.isAlarm(5000)); // what counts is the time of the stop
});

test("deaf is a connected daemon of whose MCUs none is heard for a second", () => {
  let ms = 0;
  const model = new Model(() => ms);
  const hear = (name: string): void => model.takeState({
    kind: "state", daemon: "a", utime_us: ms * 1000, mcus: [{
      part: 0, bus: "h", mcu: name, state: "READY", detail: "", inputs: "", program: "", boot_number: 1, tick: 1, motors: [],
    }],
  });
  const connect = (connected: boolean): void => model.takeDaemon({ kind: "daemon", daemon: "a", connected, why: "" });
  connect(true);
  assert.ok(!model.isDeaf("a"));
  hear("h:1");
  hear("h:2");
  ms = 1000;
  assert.ok(!model.isDeaf("a"));
  ms = 1001;
  assert.ok(model.isDeaf("a"));
  connect(false);
  assert.ok(!model.isDeaf("a"));
  connect(true);
  hear("h:2");
  assert.ok(!model.isDeaf("a"));
});

function answer(outcome: string): Answer {
  return {
    id: 1, daemon: "a", request: "move path", fields: {}, phase: "result", outcome, reason: "", detail: {}, tookMs: 0,
  };
}

class Asked {
  readonly fields: object[] = [];
  private readonly open: ((answer: Answer) => void)[] = [];
  readonly ask = (fields: object): Promise<Answer> => {
    this.fields.push(fields);
    return new Promise((settle) => this.open.push(settle));
  };
  async settle(outcome = "done"): Promise<void> {
    this.open.shift()?.(answer(outcome));
    for (let i = 0; i < 10; ++i) await Promise.resolve();
  }
}

test("a run is neither broken off nor forgotten by a check", async () => {
  const asked = new Asked();
  const sender = new PathSender();
  const run = sender.run([{ part: 1 }, { part: 2 }], asked.ask);
  assert.ok(sender.isRunning);
  assert.equal(await sender.check([{ part: 3 }], asked.ask), undefined);
  assert.equal(await sender.run([{ part: 4 }], asked.ask), undefined);
  await asked.settle();
  assert.ok(sender.isRunning);
  await asked.settle("reached");
  assert.equal((await run)?.outcome, "reached");
  assert.ok(!sender.isRunning);
  assert.deepEqual(asked.fields, [{ part: 1 }, { part: 2 }]);
});

test("a check gives way to the next one and to a run", async () => {
  const asked = new Asked();
  const sender = new PathSender();
  const first = sender.check([{ part: 1 }, { part: 2 }], asked.ask);
  const second = sender.check([{ part: 3 }], asked.ask);
  await asked.settle();
  await asked.settle();
  assert.equal(await first, undefined);
  assert.equal((await second)?.outcome, "done");
  const third = sender.check([{ part: 4 }], asked.ask);
  const run = sender.run([{ part: 5 }], asked.ask);
  await asked.settle();
  await asked.settle("stopped");
  assert.equal(await third, undefined);
  assert.equal((await run)?.outcome, "stopped");
  assert.deepEqual(asked.fields, [{ part: 1 }, { part: 3 }, { part: 4 }, { part: 5 }]);
});

test("a part that is refused ends a run", async () => {
  const asked = new Asked();
  const sender = new PathSender();
  const run = sender.run([{ part: 1 }, { part: 2 }], asked.ask);
  await asked.settle("fault");
  assert.equal((await run)?.outcome, "fault");
  assert.ok(!sender.isRunning);
  assert.equal(asked.fields.length, 1);
});
