// The last events that this page has seen: answers, and changes of state.
export interface LoggedEvent {
  at: Date;
  level: "ok" | "warning" | "error";
  text: string;
}

const kKept = 500;

export class EventLog {
  readonly events: LoggedEvent[] = []; // the newest last
  added = 0;

  add(level: LoggedEvent["level"], text: string): void {
    this.events.push({ at: new Date(), level, text });
    this.added += 1;
    if (this.events.length > kKept) this.events.shift();
  }
}
