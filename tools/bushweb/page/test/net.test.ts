import assert from "node:assert/strict";
import { test } from "node:test";
import { Connection, type Socket, type Timers } from "../src/net/connection";
import { parseMessage, type Reply } from "../src/net/messages";
import { isGood, Requests, type Link } from "../src/net/requests";

class Clock implements Timers {
  ms = 0;
  private waiting: { at: number; run: () => void }[] = [];
  nowMs(): number {
    return this.ms;
  }
  after(ms: number, run: () => void): () => void {
    const timer = { at: this.ms + ms, run };
    this.waiting.push(timer);
    return () => { this.waiting = this.waiting.filter((one) => one !== timer); };
  }
  pass(ms: number): void {
    const end = this.ms + ms;
    for (;;) {
      const next = this.waiting.filter((one) => one.at <= end).sort((a, b) => a.at - b.at)[0];
      if (!next) break;
      this.waiting = this.waiting.filter((one) => one !== next);
      this.ms = next.at;
      next.run();
    }
    this.ms = end;
  }
}

class FakeSocket implements Socket {
  bufferedAmount = 0;
  onopen: (() => void) | null = null;
  onclose: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  sent: string[] = [];
  closed = false;
  send(text: string): void {
    this.sent.push(text);
  }
  close(): void {
    this.closed = true;
  }
}

function world(): { clock: Clock; sockets: FakeSocket[]; connection: Connection } {
  const clock = new Clock();
  const sockets: FakeSocket[] = [];
  const connection = new Connection(() => {
    const socket = new FakeSocket();
    sockets.push(socket);
    return socket;
  }, clock);
  connection.start();
  return { clock, sockets, connection };
}

const kHello = '{"kind":"hello","version":"1","user":null,"may_command":false,"may_stop":true,"daemons":[]}';

test("a connection is tried again after 0.5, 1, 2 and 2 s", () => {
  const { clock, sockets } = world();
  for (const pauseMs of [500, 1000, 2000, 2000]) {
    const count = sockets.length;
    sockets[count - 1]?.onclose?.();
    clock.pass(pauseMs - 1);
    assert.equal(sockets.length, count);
    clock.pass(1);
    assert.equal(sockets.length, count + 1);
  }
});

test("after a message the first pause is 0.5 s again", () => {
  const { clock, sockets } = world();
  sockets[0]?.onclose?.();
  clock.pass(500);
  sockets[1]?.onopen?.();
  sockets[1]?.onmessage?.({ data: kHello });
  sockets[1]?.onclose?.();
  clock.pass(500);
  assert.equal(sockets.length, 3);
});

test("a socket that does not open is given up", () => {
  const { clock, sockets, connection } = world();
  clock.pass(5000);
  assert.ok(sockets[0]?.closed);
  assert.equal(connection.state, "closed");
  clock.pass(500);
  assert.equal(sockets.length, 2);
});

test("silence is said, and then a new socket is tried", () => {
  const { clock, sockets, connection } = world();
  sockets[0]?.onopen?.();
  connection.statesAreDue = true;
  clock.pass(1500);
  connection.check();
  assert.equal(connection.state, "open");
  clock.pass(1);
  connection.check();
  assert.equal(connection.state, "silent");
  assert.ok(connection.send({ kind: "ask" }));
  clock.pass(4500);
  connection.check();
  assert.equal(connection.state, "closed");
  assert.ok(sockets[0]?.closed);
});

test("silence without a daemon is nothing", () => {
  const { clock, sockets, connection } = world();
  sockets[0]?.onopen?.();
  clock.pass(60_000);
  connection.check();
  assert.equal(connection.state, "open");
});

test("nothing is sent without a socket, and nothing later", () => {
  const { clock, sockets, connection } = world();
  assert.equal(connection.send({ kind: "ask" }), false);
  sockets[0]?.onclose?.();
  assert.equal(connection.send({ kind: "ask" }), false);
  clock.pass(500);
  sockets[1]?.onopen?.();
  assert.deepEqual(sockets[1]?.sent, []);
});

test("what is no message of ours is dropped", () => {
  for (const text of ["", "{", "null", "7", "[]", "{}", '{"kind":7}', '{"kind":"later"}']) {
    assert.equal(parseMessage(text), undefined);
  }
  assert.equal(parseMessage(kHello)?.kind, "hello");
});

function linkOf(
  send: (message: object) => boolean,
  silent: () => boolean = () => false,
  heard: () => number | undefined = () => undefined,
): Link {
  return { send, isSilent: silent, get heard() { return heard(); } };
}

function reply(id: number, phase: Reply["phase"], outcome = "", reason = ""): Reply {
  return { kind: "reply", id, phase, outcome, reason, detail: null };
}

test("a request has one answer: refused, or accepted and its result", async () => {
  const sent: { id: number; request: string }[] = [];
  let ms = 0;
  const requests = new Requests(
    linkOf((message) => { sent.push(message as never); return true; }), () => ms);
  let accepted = 0;
  const one = requests.ask("bushd", "stop", { motors: [] }, { onAccepted: () => { accepted += 1; } });
  const two = requests.ask("bushd", "move");
  assert.deepEqual(sent.map(({ id, request }) => [id, request]), [[1, "stop"], [2, "move"]]);
  requests.take(reply(2, "refused", "", "theta: held"));
  requests.take(reply(1, "accepted"));
  ms = 250;
  requests.take(reply(1, "result", "done", "done"));
  requests.take(reply(1, "result", "fault", "again"));
  const first = await one;
  assert.equal(accepted, 1);
  assert.equal(first.outcome, "done");
  assert.equal(first.tookMs, 250);
  assert.ok(isGood(first));
  const second = await two;
  assert.equal(second.phase, "refused");
  assert.equal(second.reason, "theta: held");
  assert.ok(!isGood(second));
});

test("what the connection takes with it is lost, and what cannot be sent says so", async () => {
  let open = true;
  const requests = new Requests(linkOf(() => open), () => 0);
  const lost = requests.ask("bushd", "move");
  requests.lose();
  assert.equal((await lost).phase, "lost");
  open = false;
  const unsent = await requests.ask("bushd", "stop");
  assert.equal(unsent.phase, "not sent");
  assert.ok(/no connection/.test(unsent.reason));
});

test("the newest sign of life of a connection is kept, and none of the one before", () => {
  const { clock, sockets, connection } = world();
  sockets[0]?.onopen?.();
  assert.equal(connection.heard, undefined);
  for (const at of ["7", "9", "8", '"10"', "1.5", "null", "1e300"]) {
    sockets[0]?.onmessage?.({ data: `{"kind":"alive","at":${at}}` });
  }
  sockets[0]?.onmessage?.({ data: '{"kind":"alive"}' });
  assert.equal(connection.heard, 9);
  sockets[0]?.onclose?.();
  clock.pass(500);
  sockets[1]?.onopen?.();
  assert.equal(connection.heard, undefined);
  sockets[1]?.onmessage?.({ data: '{"kind":"alive","at":2}' });
  assert.equal(connection.heard, 2);
});

test("signs of life that fail to come are silence, by the clock and before a check", () => {
  const { clock, sockets, connection } = world();
  sockets[0]?.onopen?.();
  sockets[0]?.onmessage?.({ data: '{"kind":"alive","at":2}' });
  clock.pass(1500);
  assert.ok(!connection.isSilent());
  clock.pass(1);
  assert.ok(connection.isSilent());
  assert.equal(connection.state, "open");
  connection.check();
  assert.equal(connection.state, "silent");
  sockets[0]?.onmessage?.({ data: '{"kind":"alive","at":3}' });
  assert.ok(!connection.isSilent());
});

test("each request says what was heard last, and nothing before anything was", () => {
  const sent: { heard?: number }[] = [];
  let heard: number | undefined;
  const requests = new Requests(
    linkOf((message) => { sent.push(message); return true; }, () => false, () => heard), () => 0);
  void requests.ask("bushd", "stop");
  heard = 41;
  void requests.ask("bushd", "move");
  heard = 42;
  void requests.ask("bushd", "stop");
  assert.deepEqual(sent.map((one) => one.heard), [undefined, 41, 42]);
  assert.ok(!("heard" in (sent[0] ?? {})));
});

test("in silence nothing is sent that begins a motion, and what ends one is", async () => {
  const sent: [string, object][] = [];
  const requests = new Requests(linkOf((message) => {
    const { request, fields } = message as { request: string; fields: object };
    sent.push([request, fields]);
    return true;
  }, () => true), () => 0);
  const begin: [string, object][] = [
    ["move", { kind: 2 }], ["move path", { dry_run: false }], ["home", {}], ["resume", {}],
    ["jog", { speed: 1 }], ["jog", { renew: true }],
  ];
  for (const [request, fields] of begin) {
    const answer = await requests.ask("bushd", request, fields);
    assert.equal(answer.phase, "not sent", request);
    assert.ok(/silent/.test(answer.reason));
  }
  const end: [string, object][] = [
    ["stop", {}], ["emergency stop", {}], ["pause", {}], ["jog", { speed: 0 }], ["move path", { dry_run: true }],
  ];
  for (const [request, fields] of end) void requests.ask("bushd", request, fields);
  assert.deepEqual(sent, end);
});
