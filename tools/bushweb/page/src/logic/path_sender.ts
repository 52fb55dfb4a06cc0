// Sends the parts of a path, one after the other. A check gives way to a later one and to a run; a
// run gives way to nothing: its end is told, and parts of another path would break it off.
import { isGood, type Answer } from "../net/requests";

type Ask = (fields: object) => Promise<Answer>;

export class PathSender {
  private round = 0;
  private running = false;

  // From the first part of a run to the end of its motion.
  get isRunning(): boolean {
    return this.running;
  }

  // Nothing: a later check or a run has taken its place.
  async check(parts: readonly object[], ask: Ask): Promise<Answer | undefined> {
    if (this.running) return undefined;
    const round = ++this.round;
    const answer = await send(parts, ask, () => round === this.round);
    return round === this.round ? answer : undefined;
  }

  // Nothing: another one runs.
  async run(parts: readonly object[], ask: Ask): Promise<Answer | undefined> {
    if (this.running) return undefined;
    this.running = true;
    ++this.round;
    try {
      return await send(parts, ask, () => true);
    } finally {
      this.running = false;
    }
  }
}

async function send(parts: readonly object[], ask: Ask, goesOn: () => boolean): Promise<Answer | undefined> {
  let answer: Answer | undefined;
  for (const fields of parts) {
    answer = await ask(fields);
    if (!goesOn() || !isGood(answer)) break;
  }
  return answer;
}
