import assert from "node:assert/strict";
import { test } from "node:test";
import { parseNumbers, writeCsv } from "../src/logic/csv";
import { TableEditor } from "../src/logic/editor";
import { age, duration, fixed, parseNumber, parseSpeed, roundDown125, short } from "../src/logic/format";
import { located, parsePath, pathRequests, planeSpeeds } from "../src/logic/path";
import { codeOf, decelOf, delaysOf, diffOf, moveTimeS, placeOf, speedOf, tooLong } from "../src/logic/table";
import type { TableFile } from "../src/net/messages";

test("positions have their decimals and no minus before nothing", () => {
  assert.equal(fixed(-0.0001, 3), "0.000");
  assert.equal(fixed(-12.3456, 2), "-12.35");
  assert.equal(fixed(7, 0), "7");
  assert.equal(fixed(null, 2), "–");
  assert.equal(fixed(NaN, 2), "–");
});

test("numbers with as many digits as say something", () => {
  assert.deepEqual([0, 0.00123, 12.3456, 4560, -0.5, 123456].map((n) => short(n)),
    ["0", "0.00123", "12.35", "4560", "-0.5", "123456"]);
});

test("ages and durations", () => {
  assert.deepEqual([0, 1234, 9999, 10_000, 59_999, 60_000, 3.6e6, 86.4e6, Infinity].map(age),
    ["0.0 s", "1.2 s", "9.9 s", "10 s", "59 s", "1 min", "1 h", "1 d", "never heard"]);
  assert.deepEqual([0.35, 12.5, 59.96, 200, 3725].map(duration),
    ["0.35 s", "12.5 s", "1 min 0 s", "3 min 20 s", "1 h 2 min"]);
});

test("what is typed is a number or nothing", () => {
  assert.deepEqual(["12.5", " -3 ", "+4", "1,5", "−2", "1e3", ".5", "5."].map(parseNumber),
    [12.5, -3, 4, 1.5, -2, 1000, 0.5, 5]);
  for (const text of ["", "abc", "1.2.3", "1 2", "0x10", "Infinity", "NaN", "--1", "1e999", "1,2,3"]) {
    assert.equal(parseNumber(text), undefined, text);
  }
});

test("1, 2 and 5", () => {
  assert.deepEqual([18, 0.03, 1, 9.99, 0, -1].map(roundDown125), [10, 0.02, 1, 5, 1, 1]);
});

test("a path's file is read as bushctl reads it", () => {
  const table = parseNumbers("\ufeff# made by a script\r\ntheta , phi\r\n\r\n 1.5,+2\n# x\n-.5,1e2\n", "a.csv", 10);
  assert.deepEqual(table, { columns: ["theta", "phi"], rows: [[1.5, 2], [-0.5, 100]], lines: [4, 6] });
});

test("what is wrong with a file is said with its line", () => {
  const refused = (text: string, reason: RegExp): void => assert.throws(() => parseNumbers(text, "a.csv", 2), reason);
  refused("", /a\.csv: is empty/);
  refused("a,b\n", /has no row of numbers/);
  refused("a,,b\n1,2,3", /line 1: column 2 has no name/);
  refused("a,a\n1,2", /line 1: the column "a" is there twice/);
  refused("a,b\n1", /line 2: 1 numbers; allowed: 2/);
  refused("a,b\n1,two", /line 2: "two", as b; allowed: a decimal number/);
  refused("a\n1\n2\n3", /line 4: more than 2 rows/);
  for (const text of ["nan", "inf", "0x10", "1e999", "1 2", ""]) refused(`a,b\n1,${text}`, /line 2:/);
});

test("a file for spreadsheets runs nothing there", () => {
  assert.equal(writeCsv(["a", "b"], [["=1+1", 'say "no", twice'], ["-5", -5], ["-x", null]]),
    'a,b\n\'=1+1,"say ""no"", twice"\n-5,-5\n\'-x,\n');
});

const kAll = (): boolean => false;

test("a path is sent in parts of whole rows", () => {
  const rows = Array.from({ length: 3000 }, (_, i) => `${i},${-i}`).join("\n");
  const path = parsePath(`x,y\n${rows}`, "p.csv", kAll);
  const parts = pathRequests(path, { corners: "exact", speed: 2, dryRun: true }) as {
    rows: number; first_row: number; corners: number; positions: number[]; dry_run: boolean; speeds: number[] }[];
  assert.deepEqual(parts.map((part) => [part.rows, part.first_row, part.positions.length, part.corners, part.dry_run]),
    [[3000, 0, 4096, 2, true], [3000, 2048, 1904, 2, true]]);
  assert.deepEqual(parts[1]?.positions.slice(0, 2), [2048, -2048]);
  assert.deepEqual(parts[0]?.speeds, []);
});

test("a column of speeds is for one motor", () => {
  const path = parsePath("x,speed\n1,0\n2,5\n", "p.csv", kAll);
  assert.deepEqual([path.motors, path.rows, path.speeds], [["x"], [[1], [2]], [0, 5]]);
  assert.throws(() => parsePath("x,y,speed\n1,2,3", "p.csv", kAll), /is for a path of one motor/);
  assert.throws(() => parsePath("x,speed\n1,-2", "p.csv", kAll), /line 2: speed -2/);
  const named = parsePath("x,speed\n1,-2", "p.csv", (name) => name === "speed");
  assert.deepEqual([named.motors, named.speeds], [["x", "speed"], []]);
});

test("a refusal says the line of the file", () => {
  const path = parsePath("# c\nx,y\n1,2\n\n3,4\n", "p.csv", kAll);
  assert.equal(located(path, "point 2, x: beyond its limit"), "p.csv, line 5, x: beyond its limit");
  assert.equal(located(path, "point 9, x: no"), "point 9, x: no");
  assert.equal(located(path, "x: held"), "x: held");
});

test("speeds along a path are length over time in its plane", () => {
  assert.deepEqual(planeSpeeds([[3, 4], [3, 4], [6, 4]], [0, 0], [1e6, 2e6, 4e6], 0, 1), [5, 0, 1.5]);
  assert.deepEqual(planeSpeeds([[3, 4], [6, 8]], [null, null], [1e6, 2e6], 0, 1), [null, 5]);
  assert.deepEqual(planeSpeeds([[3, 4]], [0, 0], [], 0, 1), [null]);
});

function table(more: Partial<TableFile> = {}): TableFile {
  return { name: "small", description: "", revision: 1, hash: "", time_unit_ns: 100_000, cruise: null,
    accel: [10, 6], decel: [], ...more };
}

test("the worked example of docs/tables.md", () => {
  assert.deepEqual(delaysOf(table(), 4), [10, 6, 6, 10]);
  assert.ok(Math.abs(moveTimeS(table(), 4) - 3.2e-3) < 1e-12);
  assert.equal(speedOf(10, 100_000), 1000);
});

test("short moves change over where the sides meet, and long ones cruise", () => {
  const one = table({ accel: [100, 80, 60, 40], decel: [50, 90], cruise: 45 });
  assert.deepEqual(delaysOf(one, 1), [100]);
  assert.deepEqual(delaysOf(one, 3), [100, 80, 90]);
  assert.deepEqual(delaysOf(one, 8), [100, 80, 60, 45, 45, 45, 50, 90]);
  const delays = delaysOf(one, 1000).reduce((sum, delay) => sum + delay, 0);
  assert.ok(Math.abs(moveTimeS(one, 1000) - delays * 1e-4) < 1e-9);
});

test("codes are rounded so that no step is faster than asked", () => {
  for (let code = 1; code < 3000; ++code) assert.equal(codeOf(speedOf(code, 40_000), 40_000), code);
  assert.equal(codeOf(999, 100_000), 11);
  assert.equal(codeOf(0, 100_000), 65_535);
  assert.equal(codeOf(1e12, 100_000), 1);
});

test("the place in a ramp by speed and the steps that are left", () => {
  const one = table({ accel: [100, 80, 60, 40] });
  const speed = (code: number): number => speedOf(code, 100_000);
  assert.deepEqual(placeOf(one, speed(80), 500), { part: "accel", index: 1 });
  assert.deepEqual(placeOf(one, -speed(80), -500), { part: "accel", index: 1 });
  assert.deepEqual(placeOf(one, speed(40), 500), { part: "cruise", index: 3 });
  assert.deepEqual(decelOf(one), [40, 60, 80, 100]);
  assert.deepEqual(placeOf(one, speed(60), 2), { part: "decel", index: 2 });
  assert.deepEqual(placeOf(one, speed(100), 1), { part: "decel", index: 3 });
  assert.equal(placeOf(one, 0, 0), undefined);
});

test("a code stops at its neighbours, on both sides", () => {
  const editor = new TableEditor(table({ accel: [100, 80, 60], decel: [50, 70, 90] }));
  editor.setCode("accel", 1, 500);
  assert.deepEqual(editor.table.accel, [100, 100, 60]);
  editor.setCode("accel", 1, 1);
  assert.deepEqual(editor.table.accel, [100, 60, 60]);
  editor.setCode("decel", 1, 1);
  assert.deepEqual(editor.table.decel, [50, 50, 90]);
  editor.setCode("accel", 0, 1e9);
  assert.equal(editor.table.accel[0], 65_535);
});

test("undo and redo; a drag is one change", () => {
  const editor = new TableEditor(table({ accel: [100, 80, 60] }));
  editor.beginDrag();
  for (const code of [79, 75, 70]) editor.setCode("accel", 1, code);
  editor.endDrag();
  editor.setCode("accel", 2, 50);
  assert.deepEqual(editor.table.accel, [100, 70, 50]);
  editor.undo();
  assert.deepEqual(editor.table.accel, [100, 70, 60]);
  editor.undo();
  assert.deepEqual(editor.table.accel, [100, 80, 60]);
  assert.equal(editor.canUndo, false);
  editor.redo();
  editor.redo();
  assert.deepEqual(editor.table.accel, [100, 70, 50]);
  editor.undo();
  editor.insertAfter("accel", 0);
  assert.deepEqual(editor.table.accel, [100, 85, 70, 60]);
  assert.equal(editor.canRedo, false);
});

test("neighbours give way to a point that is dragged, and come back with it", () => {
  const editor = new TableEditor(table({ accel: [100, 80, 80, 60], decel: [60, 80, 90] }));
  editor.beginDrag();
  editor.dragCode("accel", 2, 95);
  assert.deepEqual(editor.table.accel, [100, 95, 95, 60]);
  editor.dragCode("accel", 2, 50);
  assert.deepEqual(editor.table.accel, [100, 80, 50, 50]);
  editor.endDrag();
  editor.beginDrag();
  editor.dragCode("decel", 1, 95);
  assert.deepEqual(editor.table.decel, [60, 95, 95]);
  editor.endDrag();
  editor.undo();
  editor.undo();
  assert.deepEqual([editor.table.accel, editor.table.decel], [[100, 80, 80, 60], [60, 80, 90]]);
});

test("a drag that comes back to where it began is no change", () => {
  const editor = new TableEditor(table({ accel: [100, 80, 60] }));
  editor.beginDrag();
  editor.dragCode("accel", 1, 70);
  editor.dragCode("accel", 1, 80);
  editor.endDrag();
  assert.equal(editor.canUndo, false);
});

test("the sides part and join, and the last code stays", () => {
  const editor = new TableEditor(table({ accel: [100, 60] }));
  editor.splitSides();
  assert.deepEqual(editor.table.decel, [60, 100]);
  editor.joinSides();
  assert.deepEqual(editor.table.decel, []);
  editor.remove("accel", 1);
  editor.remove("accel", 0);
  assert.deepEqual(editor.table.accel, [100]);
});

test("what differs between two tables", () => {
  const before = table({ accel: [100, 80, 60] });
  assert.deepEqual(diffOf(before, before), { codes: [], extra: [] });
  assert.deepEqual(diffOf(before, table({ accel: [100, 70] })), {
    codes: [
      { side: "accel", index: 1, before: 80, after: 70 },
      { side: "accel", index: 2, before: 60, after: undefined },
    ],
    extra: ["cruise: 60 -> 70"],
  });
  // Sides that mirror each other are the same as if they were written out.
  assert.deepEqual(diffOf(before, table({ accel: [100, 80, 60], decel: [60, 80, 100] })), { codes: [], extra: [] });
});

test("a greatest speed is above 0, or left out", () => {
  assert.deepEqual(["", " ", "2,5", "1e-3"].map(parseSpeed), [0, 0, 2.5, 0.001]);
  for (const text of ["0", "-0", "0.0", "-1", "1e-400", "fast"]) assert.equal(parseSpeed(text), undefined, text);
});

test("a table of more bytes than a message takes is not sent", () => {
  const of = (accel: number, decel: number): string => tooLong({
    name: "t", description: "", revision: 1, hash: "", time_unit_ns: 1000, cruise: null,
    accel: Array<number>(accel).fill(9), decel: Array<number>(decel).fill(9),
  });
  assert.equal(of(15_000, 0), "");
  assert.equal(of(7500, 7500), "");
  for (const [accel, decel] of [[15_001, 0], [7500, 7501]] as const) {
    assert.ok(/at most about 15000 codes; use bushtab on the daemon's PC/.test(of(accel, decel)));
  }
});
