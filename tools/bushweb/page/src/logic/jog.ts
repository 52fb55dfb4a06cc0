// Hold to move. The first request has the speed, renewals follow each 100 ms, and speed 0 ends it.
// The daemon ramps the motor down when no renewal has come for kKeepaliveMs, so whatever happens to
// the page ends the motion. What this adds: a page that slept does not renew an old jog when it
// wakes, and one whose renewals are not answered says that it has ended.
export const kKeepaliveMs = 400;
export const kRenewMs = 100;
const kLateMs = 300; // a timer so late: the page was suspended, or the PC is too busy to be trusted
const kUnansweredMs = 500;

// The key by which a jog is held. Keys that repeat themselves begin nothing.
export class HeldKey {
  private key = "";

  press(key: string, repeats: boolean, begin: () => void): void {
    if (repeats || this.key !== "") return;
    // The end of a jog before this one clears the key, so it is kept afterwards.
    begin();
    this.key = key;
  }

  // Whether it was the one.
  release(key: string): boolean {
    if (this.key === "" || key !== this.key) return false;
    this.key = "";
    return true;
  }

  // The jog has ended otherwise, and its key may be let go where nobody tells the page.
  clear(): void {
    this.key = "";
  }
}

export const kFocusLost = "the window lost the focus";

// Why a button that held a jog lost the focus: it stays the active element where the window did. Tab
// and the like are a way to let go, of which nothing is said.
export function whyBlurred(stillActive: boolean): string {
  return stillActive ? kFocusLost : "";
}

export interface JogPort {
  // False: it was not sent. `answered` is called with what came of it.
  send(fields: object, answered: (good: boolean, reason: string) => void): boolean;
  nowMs(): number;
  every(ms: number, run: () => void): () => void;
}

export interface JogState {
  motor: string;
  speed: number;
}

export class Jog {
  onChange: (state: JogState | undefined, why: string) => void = () => {};
  private state: JogState | undefined;
  private cancelTimer: () => void = () => {};
  private tickedMs = 0;
  private turn = 0; // answers of a jog that is over do not end the next one
  private accepted = false;
  private unansweredSinceMs: number | undefined;

  constructor(private readonly port: JogPort) {}

  get running(): JogState | undefined {
    return this.state;
  }

  // Signed speed, per second in the motor's unit. One that jogs is ended first.
  start(motor: string, speed: number): void {
    if (this.state) this.end("another jog");
    if (!Number.isFinite(speed) || speed === 0) return;
    const turn = ++this.turn;
    this.accepted = false;
    this.unansweredSinceMs = undefined;
    this.tickedMs = this.port.nowMs();
    const sent = this.port.send(
      { motor, speed, speed_in_steps: false, keepalive_ms: kKeepaliveMs },
      (_good, reason) => {
        // The motion has ended: by a limit, by a stop of somebody, or it was refused.
        if (turn === this.turn && this.state) this.finish(reason);
      },
    );
    if (!sent) {
      this.onChange(undefined, "not sent: there is no connection to bushd-web");
      return;
    }
    this.state = { motor, speed };
    this.cancelTimer = this.port.every(kRenewMs, () => this.renew());
    this.onChange(this.state, "");
  }

  // The daemon has accepted the first request.
  accept(): void {
    this.accepted = true;
  }

  // Ends it, if there is one: button or key let go, page hidden, and whatever else.
  end(why: string): void {
    if (!this.state) return;
    const { motor } = this.state;
    this.finish(why);
    this.port.send({ motor, speed: 0, keepalive_ms: kKeepaliveMs }, () => {});
  }

  // The connection is gone, and the motor ramps down by itself.
  lose(): void {
    if (this.state) this.finish("the connection was lost; the daemon ends the jog");
  }

  private renew(): void {
    if (!this.state) return;
    const nowMs = this.port.nowMs();
    const lateMs = nowMs - this.tickedMs - kRenewMs;
    this.tickedMs = nowMs;
    if (lateMs > kLateMs) {
      this.end(`the page was suspended for ${Math.round(lateMs)} ms`);
      return;
    }
    if (this.unansweredSinceMs !== undefined && nowMs - this.unansweredSinceMs > kUnansweredMs) {
      this.end("renewals are not answered");
      return;
    }
    const turn = this.turn;
    const { motor } = this.state;
    const sent = this.port.send(
      { motor, renew: true, keepalive_ms: kKeepaliveMs },
      (good, reason) => {
        if (turn !== this.turn) return;
        this.unansweredSinceMs = undefined;
        if (!good && this.state) this.finish(reason);
      },
    );
    if (!sent) {
      this.lose();
    } else if (this.accepted && this.unansweredSinceMs === undefined) {
      this.unansweredSinceMs = nowMs;
    }
  }

  private finish(why: string): void {
    this.cancelTimer();
    this.cancelTimer = () => {};
    this.state = undefined;
    ++this.turn;
    this.onChange(undefined, why);
  }
}
