// Ten minutes of position, target and speed of a motor: a ring of fixed size, the newest last.
export interface Sample {
  atS: number;
  position: number; // NaN: nobody knows
  target: number;
  speed: number;
}

export const kKeptS = 600;
const kLeastGapS = 1.2; // reports come at least twice a second; more is a gap, and drawn as one

export class Ring {
  private readonly atS: Float64Array;
  private readonly values: Float64Array[];
  private first = 0;
  private count = 0;

  constructor(private readonly room = 8192) {
    this.atS = new Float64Array(room);
    this.values = [0, 1, 2].map(() => new Float64Array(room));
  }

  get size(): number {
    return this.count;
  }

  push(sample: Sample): void {
    const last = this.lastS();
    if (sample.atS <= last) return;
    if (sample.atS - last > kLeastGapS) {
      this.put(last + kLeastGapS / 2, NaN, NaN, NaN);
    }
    this.put(sample.atS, sample.position, sample.target, sample.speed);
    while (this.count > 0 && sample.atS - (this.atS[this.first] ?? 0) > kKeptS) this.drop();
  }

  lastS(): number {
    return this.count === 0 ? -Infinity : (this.atS[this.index(this.count - 1)] ?? 0);
  }

  // As uPlot takes it: times, then positions, targets and speeds, null for a gap.
  columns(): [number[], (number | null)[], (number | null)[], (number | null)[]] {
    const times: number[] = [];
    const columns: [(number | null)[], (number | null)[], (number | null)[]] = [[], [], []];
    for (let i = 0; i < this.count; ++i) {
      const at = this.index(i);
      times.push(this.atS[at] ?? 0);
      columns.forEach((column, k) => {
        const value = this.values[k]?.[at] ?? NaN;
        column.push(Number.isNaN(value) ? null : value);
      });
    }
    return [times, ...columns];
  }

  private put(atS: number, ...values: number[]): void {
    if (!Number.isFinite(atS)) return;
    if (this.count === this.room) this.drop();
    const at = this.index(this.count);
    this.count += 1;
    this.atS[at] = atS;
    values.forEach((value, k) => {
      const column = this.values[k];
      if (column) column[at] = value;
    });
  }

  private drop(): void {
    this.first = (this.first + 1) % this.room;
    this.count -= 1;
  }

  private index(i: number): number {
    return (this.first + i) % this.room;
  }
}
