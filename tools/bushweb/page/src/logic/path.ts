// A path from a file: requests of at most 4096 positions, and how fast it goes where.
import { CsvError, parseNumbers, type NumberTable } from "./csv";

export const kMostRows = 100_000;
export const kMostMotors = 127;
export const kMostValues = 4096;

export interface Path {
  file: string;
  motors: string[];
  rows: number[][];
  speeds: number[]; // of a single motor: on the way to each row; else none
  lines: number[];
}

export type Corners = "continuous" | "exact";

export interface PathOptions {
  corners: Corners;
  speed: number; // 0: as fast as tables allow
  dryRun: boolean;
}

// `isMotor`: whether there is a motor of this name; one may be called "speed".
export function parsePath(text: string, file: string, isMotor: (name: string) => boolean): Path {
  const table: NumberTable = parseNumbers(text, file, kMostRows);
  const at = isMotor("speed") ? -1 : table.columns.indexOf("speed");
  const motors = table.columns.filter((_, i) => i !== at);
  if (motors.length === 0) throw new CsvError(`${file}: no column of a motor`);
  if (motors.length > kMostMotors) {
    throw new CsvError(
      `${file}: ${motors.length} columns; a path has at most ${kMostMotors} motors`,
    );
  }
  if (at >= 0 && motors.length > 1) {
    throw new CsvError(
      `${file}: a column "speed" is for a path of one motor, and this one has ${motors.length}`,
    );
  }
  const speeds = at < 0 ? [] : table.rows.map((row) => row[at] ?? 0);
  const negative = speeds.findIndex((speed) => speed < 0);
  if (negative >= 0) {
    throw new CsvError(
      `${file}, line ${table.lines[negative]}: speed ${speeds[negative]}; allowed: 0, as fast as ` +
        `the table allows, or more`,
    );
  }
  return {
    file,
    motors,
    rows: table.rows.map((row) => row.filter((_, i) => i !== at)),
    speeds,
    lines: table.lines,
  };
}

// One after the other; the last one begins the motion.
export function pathRequests(path: Path, options: PathOptions): object[] {
  const most = Math.max(Math.floor(kMostValues / path.motors.length), 1);
  const requests: object[] = [];
  for (let first = 0; first < path.rows.length; first += most) {
    const end = Math.min(first + most, path.rows.length);
    requests.push({
      rows: path.rows.length,
      first_row: first,
      corners: options.corners === "exact" ? 2 : 1,
      dry_run: options.dryRun,
      speed: options.speed,
      speed_in_steps: false,
      motors: path.motors,
      positions: path.rows.slice(first, end).flat(),
      speeds: path.speeds.slice(first, end),
    });
  }
  return requests;
}

// "point 3, theta: ..." is the third row; its line in the file is what people look for.
export function pointOf(reason: string): number | undefined {
  const match = /^point (\d+)\b/.exec(reason);
  return match ? Number(match[1]) : undefined;
}

export function located(path: Path, reason: string): string {
  const point = pointOf(reason);
  const line = point === undefined ? undefined : path.lines[point - 1];
  if (line === undefined) return reason;
  return `${path.file}, line ${line}${reason.replace(/^point \d+/, "")}`;
}

// Mean speed on the way to each row in the plane of two columns, per second; null: not known. The
// way to the first row begins where the motors stand.
export function planeSpeeds(
  rows: number[][],
  from: (number | null)[],
  pointsUs: number[],
  x: number,
  y: number,
): (number | null)[] {
  if (pointsUs.length !== rows.length) return rows.map(() => null);
  return rows.map((row, i) => {
    const before = i === 0 ? from : rows[i - 1];
    const x0 = before?.[x];
    const y0 = before?.[y];
    const x1 = row[x];
    const y1 = row[y];
    if (x0 == null || y0 == null || x1 === undefined || y1 === undefined) return null;
    const us = (pointsUs[i] ?? 0) - (i === 0 ? 0 : (pointsUs[i - 1] ?? 0));
    const length = x === y ? Math.abs(x1 - x0) : Math.hypot(x1 - x0, y1 - y0);
    if (us <= 0) return length === 0 ? 0 : null;
    return (length * 1e6) / us;
  });
}
