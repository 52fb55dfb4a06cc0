// How late a message is: by how much its way to the page took longer than that of the quickest one.
// A page that slept, or whose messages wait somewhere, gets old states in a burst, and these must
// not look as if they had just been made.
//
//   lateness = (t - u) - min(t - u)        t: the page's clock, u: the daemon's, both in ms
//
// Clocks drift apart, so the least difference grows by kDrift. A daemon's clock that is set back
// begins anew; one that is set forward gives a new least difference by itself.
const kDrift = 0.001; // NTP changes a clock's rate by 0.0005 at most

export class Lateness {
  private leastMs: number | undefined;
  private atMs = 0;
  private sentMs = 0;

  // How late a message is that was made at `sentMs` of the daemon's clock and comes at `nowMs` of the page's.
  of(sentMs: number, nowMs: number): number {
    if (!Number.isFinite(sentMs)) return 0;
    const differenceMs = nowMs - sentMs;
    if (this.leastMs === undefined || sentMs < this.sentMs) {
      this.leastMs = differenceMs;
    } else {
      this.leastMs = Math.min(this.leastMs + (nowMs - this.atMs) * kDrift, differenceMs);
    }
    this.atMs = nowMs;
    this.sentMs = sentMs;
    return differenceMs - this.leastMs;
  }
}
