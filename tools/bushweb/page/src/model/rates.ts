// Errors a second, from counts that only grow and come once a second.
const kWindowMs = 10_000;

export class Rate {
  private readonly seen: { atMs: number; count: number }[] = [];

  take(count: number, nowMs: number): void {
    const last = this.seen[this.seen.length - 1];
    // A daemon that was started again counts from 0.
    if (last && count < last.count) this.seen.length = 0;
    this.seen.push({ atMs: nowMs, count });
    while (this.seen.length > 2 && nowMs - (this.seen[1]?.atMs ?? 0) > kWindowMs) this.seen.shift();
  }

  // The rate of the last ten seconds; nothing until there are two counts.
  perSecond(): number | undefined {
    const first = this.seen[0];
    const last = this.seen[this.seen.length - 1];
    if (!first || !last || last.atMs <= first.atMs) return undefined;
    return ((last.count - first.count) * 1000) / (last.atMs - first.atMs);
  }
}
