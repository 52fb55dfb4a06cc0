// The one WebSocket of the page. It opens itself again after 0.5, 1, 2, 2, ... s, and closes a
// socket over which nothing comes although states are due: a network that was cut tells nobody.
import { parseMessage, type FromServer } from "./messages";

export interface Socket {
  readonly bufferedAmount: number;
  onopen: (() => void) | null;
  onclose: (() => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  send(text: string): void;
  close(): void;
}

export interface Timers {
  nowMs(): number;
  after(ms: number, run: () => void): () => void; // gives what cancels it
}

export type LinkState = "connecting" | "open" | "silent" | "closed";

const kPausesMs = [500, 1000, 2000];
const kOpenLimitMs = 5000;
export const kSilentMs = 1500; // states come twice a second at least
const kGiveUpMs = 6000;

export class Connection {
  state: LinkState = "connecting";
  lastHeardMs = 0;
  nextTryMs = 0; // while it is closed
  statesAreDue = false; // a daemon is connected and has MCUs, so silence means something
  onState: (state: LinkState) => void = () => {};
  onMessage: (message: FromServer) => void = () => {};

  private newest: number | undefined;
  private socket: Socket | undefined;
  private tries = 0;
  private cancelTimer: () => void = () => {};
  private wasOpen = false;

  constructor(
    private readonly open: () => Socket,
    private readonly timers: Timers,
  ) {}

  start(): void {
    this.connect();
  }

  // At once, for what has changed on the page's side: another token, the network is back.
  reconnect(): void {
    this.tries = 0;
    this.drop();
    this.connect();
  }

  // False: it could not be sent, and never will be. Nothing is kept for later: a request is
  // about the moment in which somebody made it.
  send(message: object): boolean {
    if (!this.socket || !this.isOpen()) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  // It was tried, and nothing has been heard since.
  hasFailed(): boolean {
    return this.tries > 0;
  }

  isOpen(): boolean {
    return this.state === "open" || this.state === "silent";
  }

  // Nothing has come for so long that what the page shows is no ground to move anything. By the
  // clock and not by the last check(), as timers of a page may be late.
  isSilent(): boolean {
    return this.isOpen() && this.somethingIsDue() && this.silentMs() > kSilentMs;
  }

  // The newest `at` of this connection.
  get heard(): number | undefined {
    return this.newest;
  }

  // Called several times a second.
  check(): void {
    if (!this.isOpen() || !this.somethingIsDue()) return;
    const silentMs = this.silentMs();
    if (silentMs > kGiveUpMs) {
      this.drop();
      this.closed();
    } else {
      this.set(silentMs > kSilentMs ? "silent" : "open");
    }
  }

  private silentMs(): number {
    return this.timers.nowMs() - this.lastHeardMs;
  }

  private somethingIsDue(): boolean {
    return this.statesAreDue || this.newest !== undefined;
  }

  private connect(): void {
    this.cancelTimer();
    this.statesAreDue = false;
    this.newest = undefined; // another bushd-web may count from anew
    this.set("connecting");
    const socket = this.open();
    this.socket = socket;
    this.wasOpen = false;
    this.cancelTimer = this.timers.after(kOpenLimitMs, () => {
      this.drop();
      this.closed();
    });
    socket.onopen = () => {
      this.cancelTimer();
      this.wasOpen = true;
      this.lastHeardMs = this.timers.nowMs();
      this.set("open");
    };
    socket.onmessage = (event) => {
      this.lastHeardMs = this.timers.nowMs();
      this.tries = 0;
      if (this.state === "silent") this.set("open");
      const message = typeof event.data === "string" ? parseMessage(event.data) : undefined;
      if (message?.kind === "alive") this.takeAlive(message.at);
      else if (message) this.onMessage(message);
    };
    socket.onclose = () => {
      if (this.socket === socket) this.closed();
    };
  }

  private takeAlive(at: unknown): void {
    if (typeof at !== "number" || !Number.isSafeInteger(at)) return;
    this.newest = Math.max(this.newest ?? at, at);
  }

  private closed(): void {
    this.cancelTimer();
    this.socket = undefined;
    const pauseMs = kPausesMs[Math.min(this.tries, kPausesMs.length - 1)] ?? 2000;
    this.tries += 1;
    this.nextTryMs = this.timers.nowMs() + pauseMs;
    this.set("closed");
    this.cancelTimer = this.timers.after(pauseMs, () => this.connect());
  }

  private drop(): void {
    this.cancelTimer();
    const socket = this.socket;
    this.socket = undefined;
    if (!socket) return;
    socket.onopen = socket.onclose = socket.onmessage = null;
    socket.close();
    if (this.wasOpen) this.set("closed");
  }

  private set(state: LinkState): void {
    if (state === this.state) return;
    this.state = state;
    this.onState(state);
  }
}

export const browserTimers: Timers = {
  nowMs: () => performance.now(),
  after: (ms, run) => {
    const timer = setTimeout(run, ms);
    return () => clearTimeout(timer);
  },
};

export function browserSocket(): Socket {
  const url = new URL("api/live", location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  url.hash = "";
  url.search = "";
  return new WebSocket(url, "bushd") as unknown as Socket;
}
