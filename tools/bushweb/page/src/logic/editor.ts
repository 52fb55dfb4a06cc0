// Edits of a table, with undo and redo. A drag of a point is one change, however often it moves. A
// code stops at its neighbours, so that the sides stay ordered: accel never rises, decel never falls.
import type { TableFile } from "../net/messages";
import { isMirrored, kMostCode, type Side } from "./table";

const kKept = 500;

export class TableEditor {
  private past: TableFile[] = [];
  private future: TableFile[] = [];
  private drag: TableFile | undefined; // as it was when the drag began

  constructor(private now: TableFile) {}

  get table(): TableFile {
    return this.now;
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }

  codes(side: Side): readonly number[] {
    return side === "accel" ? this.now.accel : this.now.decel;
  }

  // What a code may be between its neighbours.
  range(side: Side, index: number): { low: number; high: number } {
    const codes = this.codes(side);
    const before = codes[index - 1];
    const after = codes[index + 1];
    return side === "accel"
      ? { low: after ?? 1, high: before ?? kMostCode }
      : { low: before ?? 1, high: after ?? kMostCode };
  }

  setCode(side: Side, index: number, code: number): void {
    const codes = [...this.codes(side)];
    if (index < 0 || index >= codes.length || !Number.isFinite(code)) return;
    const { low, high } = this.range(side, index);
    const kept = Math.min(Math.max(Math.round(code), low), high);
    if (codes[index] === kept) return;
    codes[index] = kept;
    this.change({ ...this.now, [side]: codes });
  }

  // While a point is dragged its neighbours give way, counted from where the drag began: so they
  // come back when the point does.
  dragCode(side: Side, index: number, code: number): void {
    const from = this.drag ?? this.now;
    const codes = [...(side === "accel" ? from.accel : from.decel)];
    if (codes[index] === undefined || !Number.isFinite(code)) return;
    const kept = Math.min(Math.max(Math.round(code), 1), kMostCode);
    const moved = codes.map((other, i) => {
      if (i === index) return kept;
      const slower = side === "accel" ? i < index : i > index;
      return slower ? Math.max(other, kept) : Math.min(other, kept);
    });
    if (moved.every((other, i) => other === this.codes(side)[i])) return;
    this.change({ ...this.now, [side]: moved });
  }

  // A code between this one and the next, as the mean of both.
  insertAfter(side: Side, index: number): void {
    const codes = [...this.codes(side)];
    const here = codes[index];
    if (here === undefined) return;
    codes.splice(index + 1, 0, Math.ceil((here + (codes[index + 1] ?? here)) / 2));
    this.change({ ...this.now, [side]: codes });
  }

  remove(side: Side, index: number): void {
    const codes = [...this.codes(side)];
    if (codes.length <= 1 || codes[index] === undefined) return;
    codes.splice(index, 1);
    this.change({ ...this.now, [side]: codes });
  }

  // The decelerating side gets codes of its own.
  splitSides(): void {
    if (isMirrored(this.now)) this.change({ ...this.now, decel: [...this.now.accel].reverse() });
  }

  joinSides(): void {
    if (!isMirrored(this.now)) this.change({ ...this.now, decel: [] });
  }

  setCruise(cruise: number | null): void {
    if (cruise !== this.now.cruise) this.change({ ...this.now, cruise });
  }

  setDescription(description: string): void {
    if (description !== this.now.description) this.change({ ...this.now, description });
  }

  beginDrag(): void {
    this.drag ??= this.now;
  }

  endDrag(): void {
    const before = this.drag;
    this.drag = undefined;
    if (!before || before === this.now) return;
    if (sameCodes(before, this.now)) this.now = before; // it came back
    else this.keep(before);
  }

  undo(): void {
    this.endDrag();
    const before = this.past.pop();
    if (!before) return;
    this.future.push(this.now);
    this.now = before;
  }

  redo(): void {
    const after = this.future.pop();
    if (!after) return;
    this.past.push(this.now);
    this.now = after;
  }

  private change(table: TableFile): void {
    if (!this.drag) this.keep(this.now);
    this.now = table;
  }

  private keep(before: TableFile): void {
    this.past.push(before);
    if (this.past.length > kKept) this.past.shift();
    this.future = [];
  }
}

function sameCodes(one: TableFile, other: TableFile): boolean {
  const same = (a: number[], b: number[]): boolean =>
    a.length === b.length && a.every((code, i) => code === b[i]);
  return same(one.accel, other.accel) && same(one.decel, other.decel);
}
