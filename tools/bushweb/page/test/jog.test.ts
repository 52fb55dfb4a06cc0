import assert from "node:assert/strict";
import { test } from "node:test";
import { HeldKey, Jog, kFocusLost, kKeepaliveMs, kRenewMs, whyBlurred, type JogPort } from "../src/logic/jog";

type Answered = (good: boolean, reason: string) => void;

class World implements JogPort {
  sent: { fields: Record<string, unknown>; answered: Answered }[] = [];
  ms = 1000;
  open = true;
  answers = true; // renewals are, at once
  run: (() => void) | undefined;

  send(fields: object, answered: Answered): boolean {
    if (!this.open) return false;
    this.sent.push({ fields: fields as Record<string, unknown>, answered });
    if ("renew" in fields && this.answers) answered(true, "done");
    return true;
  }
  nowMs(): number {
    return this.ms;
  }
  every(ms: number, run: () => void): () => void {
    assert.equal(ms, kRenewMs);
    this.run = run;
    return () => { this.run = undefined; };
  }
  pass(ms: number): void {
    this.ms += ms;
    this.run?.();
  }
  renewals(): number {
    return this.sent.filter(({ fields }) => fields["renew"] === true).length;
  }
  last(): Record<string, unknown> {
    return this.sent[this.sent.length - 1]?.fields ?? {};
  }
}

function begin(): { world: World; jog: Jog; ends: string[] } {
  const world = new World();
  const jog = new Jog(world);
  const ends: string[] = [];
  jog.onChange = (state, why) => { if (!state) ends.push(why); };
  jog.start("theta", -2.5);
  jog.accept();
  return { world, jog, ends };
}

test("a jog begins with its speed and is renewed without one", () => {
  const { world, jog } = begin();
  assert.deepEqual(world.last(),
    { motor: "theta", speed: -2.5, speed_in_steps: false, keepalive_ms: kKeepaliveMs });
  for (let i = 0; i < 5; ++i) world.pass(100);
  assert.equal(world.renewals(), 5);
  assert.deepEqual(world.last(), { motor: "theta", renew: true, keepalive_ms: kKeepaliveMs });
  jog.end("");
  assert.deepEqual(world.last(), { motor: "theta", speed: 0, keepalive_ms: kKeepaliveMs });
  assert.equal(world.run, undefined);
});

test("a page that was suspended ends the jog and does not renew it", () => {
  const { world, jog, ends } = begin();
  world.pass(100);
  world.pass(401);
  assert.equal(world.renewals(), 1);
  assert.equal(world.last()["speed"], 0);
  assert.equal(jog.running, undefined);
  assert.deepEqual(ends, ["the page was suspended for 301 ms"]);
});

test("a timer that is 300 ms late is not too late", () => {
  const { world, jog } = begin();
  world.pass(400);
  assert.equal(world.renewals(), 1);
  assert.ok(jog.running);
});

test("a jog that others have ended is not renewed and not ended again", () => {
  const { world, jog, ends } = begin();
  world.sent[0]?.answered(true, "theta: stopped by command 7 of panel");
  assert.equal(jog.running, undefined);
  assert.deepEqual(ends, ["theta: stopped by command 7 of panel"]);
  jog.end("let go");
  assert.equal(world.sent.length, 1);
});

test("a refused renewal ends it", () => {
  const { world, jog, ends } = begin();
  world.answers = false;
  world.pass(100);
  world.sent[1]?.answered(false, "theta does not jog");
  assert.equal(jog.running, undefined);
  assert.deepEqual(ends, ["theta does not jog"]);
});

test("renewals that nobody answers end it", () => {
  const { world, jog } = begin();
  world.answers = false;
  for (let i = 0; i < 6; ++i) world.pass(100);
  assert.ok(jog.running);
  world.pass(100);
  assert.equal(jog.running, undefined);
  assert.equal(world.last()["speed"], 0);
});

test("answers of a jog before do not end the next one", () => {
  const { world, jog } = begin();
  jog.end("");
  jog.start("theta", 1);
  world.sent[0]?.answered(true, "done");
  assert.ok(jog.running);
});

test("without a connection nothing begins, and one that is cut ends it", () => {
  const world = new World();
  world.open = false;
  const jog = new Jog(world);
  jog.start("theta", 1);
  assert.equal(jog.running, undefined);
  assert.equal(world.run, undefined);
  world.open = true;
  jog.start("theta", 1);
  world.open = false;
  world.pass(100);
  assert.equal(jog.running, undefined);
});

test("speed 0 and what is no number begin nothing", () => {
  const world = new World();
  const jog = new Jog(world);
  for (const speed of [0, NaN, Infinity]) jog.start("theta", speed);
  assert.equal(world.sent.length, 0);
});

test("a key begins once, and again after its jog has ended otherwise", () => {
  const key = new HeldKey();
  let begun = 0;
  const press = (name: string, repeats = false): void => key.press(name, repeats, () => { begun += 1; });
  press("ArrowRight", true);
  assert.equal(begun, 0);
  press("ArrowRight");
  press("ArrowRight", true);
  press("ArrowLeft");
  assert.equal(begun, 1);
  assert.ok(!key.release("ArrowLeft"));
  key.clear();
  assert.ok(!key.release("ArrowRight"));
  press("ArrowLeft");
  assert.equal(begun, 2);
  assert.ok(key.release("ArrowLeft"));
  assert.ok(!key.release("ArrowLeft"));
});

test("a jog whose button loses the focus with the window says so, and by Tab it is let go", () => {
  for (const [stillActive, said] of [[true, "the window lost the focus"], [false, ""]] as const) {
    const { jog, world, ends } = begin();
    jog.end(whyBlurred(stillActive));
    jog.end(kFocusLost); // the window's own blur comes after it
    assert.deepEqual(ends, [said]);
    assert.equal(world.last()["speed"], 0);
  }
});

test("a key that takes the place of another jog ends its own when it is let go", () => {
  const { jog } = begin();
  const key = new HeldKey();
  jog.onChange = (state) => { if (!state) key.clear(); };
  key.press("ArrowRight", false, () => jog.start("theta", 1));
  assert.deepEqual(jog.running, { motor: "theta", speed: 1 });
  assert.ok(key.release("ArrowRight"));
});
