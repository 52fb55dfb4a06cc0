// Requests and their answers. A request is sent at once or not at all: it never waits behind
// others, and none is sent a second time, as it may have been carried out.
import { beginsMotion } from "../logic/motion";
import type { Reply } from "./messages";

// "lost": the connection ended before the answer came.
export interface Answer {
  id: number;
  daemon: string;
  request: string;
  fields: object;
  phase: "accepted" | "refused" | "result" | "lost" | "not sent";
  outcome: string;
  reason: string;
  detail: NonNullable<Reply["detail"]>;
  tookMs: number;
}

export interface Options {
  quiet?: boolean; // not for notices and the log: renewals, and what only reads
  onAccepted?: () => void;
}

export interface Link {
  readonly heard: number | undefined; // the newest sign of life of bushd-web
  isSilent(): boolean;
  send(message: object): boolean;
}

interface Waiting {
  answer: Answer;
  options: Options;
  sentMs: number;
  settle: (answer: Answer) => void;
}

export class Requests {
  onAnswer: (answer: Answer, options: Options) => void = () => {};
  private count = 0;
  private readonly waiting = new Map<number, Waiting>();

  constructor(
    private readonly link: Link,
    private readonly nowMs: () => number,
  ) {}

  ask(daemon: string, request: string, fields: object = {}, options: Options = {}): Promise<Answer> {
    const { heard } = this.link;
    const message = { kind: "ask", daemon, request, fields, ...(heard === undefined ? {} : { heard }) };
    return this.put(message, daemon, request, fields, options);
  }

  // Those that are not requests of the daemon: "check" and "doctor".
  call(kind: "check" | "doctor", message: object): Promise<Answer> {
    return this.put({ kind, ...message }, "", kind, message, { quiet: true });
  }

  take(reply: Reply): void {
    const waiting = this.waiting.get(reply.id);
    if (!waiting) return;
    waiting.answer.phase = reply.phase;
    if (reply.phase === "accepted") {
      waiting.options.onAccepted?.();
      this.onAnswer({ ...waiting.answer, tookMs: this.nowMs() - waiting.sentMs }, waiting.options);
      return;
    }
    this.waiting.delete(reply.id);
    waiting.answer.outcome = reply.outcome ?? "";
    waiting.answer.reason = reply.reason ?? "";
    waiting.answer.detail = reply.detail ?? {};
    this.finish(waiting);
  }

  // The connection has ended: what was asked may have been carried out or not.
  lose(): void {
    const all = [...this.waiting.values()];
    this.waiting.clear();
    for (const waiting of all) {
      waiting.answer.phase = "lost";
      waiting.answer.reason =
        "the connection ended before the answer came: look where the motors stand";
      this.finish(waiting);
    }
  }

  private put(
    message: object,
    daemon: string,
    request: string,
    fields: object,
    options: Options,
  ): Promise<Answer> {
    const id = ++this.count;
    const isTooLate = beginsMotion(request, fields) && this.link.isSilent();
    const answer: Answer = {
      id, daemon, request, fields, phase: "not sent", outcome: "", detail: {}, tookMs: 0,
      reason: isTooLate
        ? "not sent: bushd-web is silent, and what the page shows may be old"
        : "not sent: there is no connection to bushd-web",
    };
    return new Promise((settle) => {
      const waiting = { answer, options, sentMs: this.nowMs(), settle };
      // Before it is sent, so that no answer can come too early.
      this.waiting.set(id, waiting);
      if (!isTooLate && this.link.send({ ...message, id })) {
        answer.phase = "lost";
        answer.reason = "";
        return;
      }
      this.waiting.delete(id);
      this.finish(waiting);
    });
  }

  private finish(waiting: Waiting): void {
    waiting.answer.tookMs = this.nowMs() - waiting.sentMs;
    this.onAnswer(waiting.answer, waiting.options);
    waiting.settle(waiting.answer);
  }
}

export function isGood(answer: Answer): boolean {
  return answer.phase === "result" && (answer.outcome === "done" || answer.outcome === "reached");
}
