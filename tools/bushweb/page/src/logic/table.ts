// Arithmetic of acceleration tables (docs/tables.md, "The rule"). A delay comes before its step:
//
//   delay before step j of N = max(A(j-1), D(N-j), c)
//
// A(i): code i of accel; D(i): the code i places before the end of decel; both c beyond their side.
import type { Motor } from "../model/model";
import type { TableFile } from "../net/messages";

export const kMostCode = 65_535;
export type Side = "accel" | "decel";

// A message that sets a table has at most as many; a code takes 4 bytes.
const kMostBytes = 60_000;

// Why a table cannot be set over the control socket; "": it can.
export function tooLong(table: TableFile): string {
  const bytes = 4 * (table.accel.length + table.decel.length);
  return bytes <= kMostBytes ? ""
    : "a table that is set over the control socket has at most about 15000 codes; use bushtab on the daemon's PC";
}

export function cruiseOf(table: TableFile): number {
  return table.cruise || (table.accel[table.accel.length - 1] ?? 0);
}

// Whether the sides mirror each other, so that an edit of one is one of both.
export function isMirrored(table: TableFile): boolean {
  return table.decel.length === 0;
}

// Fast to slow, also where the file leaves it out.
export function decelOf(table: TableFile): number[] {
  return isMirrored(table) ? [...table.accel].reverse() : table.decel;
}

export function speedOf(code: number, timeUnitNs: number): number {
  return 1e9 / (code * timeUnitNs);
}

// Rounded up, so that no step is faster than asked.
export function codeOf(stepsPerS: number, timeUnitNs: number): number {
  if (!(stepsPerS > 0)) return kMostCode;
  const exact = 1e9 / (stepsPerS * timeUnitNs);
  // A code whose own speed was asked for must not become the next one by rounding.
  const code = Math.ceil(exact * (1 - 1e-12));
  return Math.min(Math.max(code, 1), kMostCode);
}

export function delaysOf(table: TableFile, steps: number): number[] {
  const cruise = cruiseOf(table);
  const decel = decelOf(table);
  const delays: number[] = [];
  for (let j = 1; j <= steps; ++j) {
    const a = table.accel[j - 1] ?? cruise;
    const d = decel[decel.length - 1 - (steps - j)] ?? cruise;
    delays.push(Math.max(a, d, cruise));
  }
  return delays;
}

export function moveTimeS(table: TableFile, steps: number): number {
  const cruise = cruiseOf(table);
  const decel = decelOf(table);
  const ends = table.accel.length + decel.length;
  const curved = Math.min(steps, ends);
  const units = delaysOf(table, curved).reduce((sum, delay) => sum + delay, 0);
  return ((units + Math.max(0, steps - ends) * cruise) * table.time_unit_ns) / 1e9;
}

// Speed over steps of one side, as a curve from the first step on.
export function curveOf(table: TableFile, side: Side): { steps: number[]; speeds: number[] } {
  const codes = side === "accel" ? table.accel : decelOf(table);
  const cruise = cruiseOf(table);
  return {
    steps: codes.map((_, i) => i),
    speeds: codes.map((code) => speedOf(Math.max(code, cruise), table.time_unit_ns)),
  };
}

export interface Place {
  part: Side | "cruise";
  index: number;
}

// Where a motor is in its ramp, by its speed and the steps that it has left. It brakes if what is
// left is no more than what braking from this speed takes. undefined: it stands.
export function placeOf(
  table: TableFile,
  stepsPerS: number,
  stepsLeft: number | undefined,
): Place | undefined {
  const speed = Math.abs(stepsPerS);
  if (!(speed > 0)) return undefined;
  const code = 1e9 / (speed * table.time_unit_ns);
  const tolerance = code * 1.001; // speeds come rounded
  const cruise = cruiseOf(table);
  const decel = decelOf(table);
  const braking = decel.filter((delay) => delay * 1.001 >= code).length;
  if (stepsLeft !== undefined && Math.abs(stepsLeft) <= braking && braking > 0) {
    const index = Math.min(Math.max(decel.length - Math.max(Math.abs(stepsLeft), 1), 0), decel.length - 1);
    return { part: "decel", index };
  }
  if (code <= cruise * 1.001) return { part: "cruise", index: table.accel.length - 1 };
  const index = table.accel.findIndex((delay) => delay <= tolerance);
  return { part: "accel", index: index < 0 ? table.accel.length - 1 : index };
}

// Groups of which a motor has this table.
export function groupsWith(motors: Iterable<Motor>, table: string): string[] {
  const groups = new Set<string>();
  for (const { about } of motors) if (about?.group && about.table.name === table) groups.add(about.group);
  return [...groups];
}

// The revision of this table that is in service: that of the group's motors, else of any. Undefined: no motor has it.
export function servedRevision(motors: Iterable<Motor>, table: string, group: string): number | undefined {
  let other: number | undefined;
  for (const { about } of motors) {
    if (about?.table.name !== table || about.table.revision <= 0) continue;
    if (about.group === group) return about.table.revision;
    other ??= about.table.revision;
  }
  return other;
}

export interface CodeChange {
  side: Side;
  index: number;
  before: number | undefined;
  after: number | undefined;
}

// What differs, code by code; `extra` are the other keys.
export function diffOf(
  before: TableFile,
  after: TableFile,
): { codes: CodeChange[]; extra: string[] } {
  const codes: CodeChange[] = [];
  const compare = (side: Side, one: number[], other: number[]): void => {
    for (let i = 0; i < Math.max(one.length, other.length); ++i) {
      if (one[i] !== other[i]) codes.push({ side, index: i, before: one[i], after: other[i] });
    }
  };
  compare("accel", before.accel, after.accel);
  if (!isMirrored(before) || !isMirrored(after)) compare("decel", decelOf(before), decelOf(after));
  const extra: string[] = [];
  if (cruiseOf(before) !== cruiseOf(after)) {
    extra.push(`cruise: ${cruiseOf(before)} -> ${cruiseOf(after)}`);
  }
  if (before.time_unit_ns !== after.time_unit_ns) {
    extra.push(`time unit: ${before.time_unit_ns} ns -> ${after.time_unit_ns} ns`);
  }
  return { codes, extra };
}
