// What came of a stop, daemon by daemon. A daemon that hangs says nothing, and whoever has pressed
// Esc must be told so while there is time to walk to the emergency stop of the machine.
export const kUnansweredMs = 1000;
export const kNotAnswered = "NOT ANSWERED: use the emergency stop of the machine";

interface Asked {
  text: string;
  answered: boolean;
  deaf: boolean;
}

export class StopRound {
  private readonly asked = new Map<string, Asked>();

  // `isDeaf`: a daemon that is connected, and of which no MCU has been heard lately. That it
  // accepts the stop says nothing of its motors.
  constructor(
    readonly name: string,
    daemons: readonly string[],
    private readonly sentMs: number,
    private readonly isDeaf: (daemon: string) => boolean,
  ) {
    for (const daemon of daemons) {
      this.asked.set(daemon, { text: "sent", answered: false, deaf: isDeaf(daemon) });
    }
  }

  // `answered`: the daemon, or bushd-web for it, has said something.
  tell(daemon: string, text: string, answered: boolean): void {
    const asked = this.asked.get(daemon);
    if (!asked) return;
    asked.text = text;
    asked.answered ||= answered;
  }

  isAlarm(nowMs: number): boolean {
    return [...this.asked].some(([daemon, asked]) => this.fails(daemon, asked, nowMs));
  }

  words(nowMs: number): string {
    const several = this.asked.size > 1;
    const all = [...this.asked].map(([daemon, asked]) => {
      const fails = this.fails(daemon, asked, nowMs);
      const what = !fails ? asked.text
        : asked.text === "sent" ? kNotAnswered : `${kNotAnswered} (${asked.text})`;
      return several ? `${daemon}: ${what}` : what;
    });
    return `${this.name}: ${all.join("; ")}`;
  }

  private fails(daemon: string, asked: Asked, nowMs: number): boolean {
    if (asked.deaf && !this.isDeaf(daemon)) asked.deaf = false;
    return asked.deaf || (!asked.answered && nowMs - this.sentMs >= kUnansweredMs);
  }
}
