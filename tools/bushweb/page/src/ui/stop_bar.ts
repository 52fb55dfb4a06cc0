// STOP on every view. Esc and the button ramp down all motors of all daemons, at once and without a
// question. Emergency stop is elsewhere and looks different: it latches until faults are cleared.
import type { App } from "./app";
import { button, el, mark, put } from "./dom";
import type { Answer } from "../net/requests";

export class StopBar {
  private readonly stopButton = button("STOP all motors", () => this.stop(), {
    class: "stop-all", testid: "stop-all", "aria-keyshortcuts": "Escape",
  });
  private readonly said = el("div", { class: "stop-said", testid: "stop-said", role: "alert" });
  readonly root = el(
    "footer", { class: "stop-bar", testid: "stop-bar" },
    this.stopButton, this.said,
  );
  readonly emergency = button("Emergency stop", () => this.emergencyStop(), {
    class: "estop", testid: "estop", title:
      "Stops all motors of all buses at once, and latches until faults are cleared",
  });
  private state = "";
  private round = 0;
  private answers = new Map<string, string>();

  constructor(private readonly app: App) {
    // Before anything else gets the key.
    window.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || event.isComposing) return;
      event.preventDefault();
      if (!event.repeat) this.stop();
    }, { capture: true });
    this.update();
  }

  stop(): void {
    this.ask("stop", { motors: [] }, "Stop");
  }

  emergencyStop(): void {
    this.ask("emergency stop", {}, "Emergency stop");
  }

  // Says whether a stop can be sent, and whether somebody is there to carry it out.
  update(): void {
    const open = this.app.connection.isOpen();
    const daemons = [...this.app.model.daemons.values()].filter((daemon) => daemon.told);
    const nobody = open && daemons.length > 0 && daemons.every((daemon) => !daemon.connected);
    mark(this.root, "cut", !open || nobody);
    put(this.stopButton,
      !open ? "STOP CANNOT BE SENT" : nobody ? "STOP REACHES NO DAEMON" : "STOP all motors");
    const may = this.app.model.hello?.may_stop ?? true;
    const state = !open ? "No connection to bushd-web. Use the emergency stop of the machine, or bushctl stop."
      : nobody ? "No daemon is connected. If motors move, use the emergency stop of the machine."
        : may ? "Esc stops too" : "This page may not stop motors: it has no token";
    if (state === this.state) return;
    // What came of the last stop stays until the state is another.
    this.state = state;
    put(this.said, state);
  }

  private ask(request: string, fields: object, name: string): void {
    const daemons = [...this.app.model.daemons.keys()];
    const round = ++this.round;
    this.answers = new Map();
    if (daemons.length === 0) {
      put(this.said, `${name}: not sent, as no daemon is known to this page`);
      return;
    }
    // All are sent before anything is waited for or drawn.
    const asked = daemons.map((daemon) => this.app.requests.ask(daemon, request, fields, {
      onAccepted: () => this.tell(round, name, daemon, "accepted, motors ramp down"),
    }));
    for (const daemon of daemons) this.tell(round, name, daemon, "sent");
    asked.forEach((answer, i) => {
      void answer.then((told) => this.tell(round, name, daemons[i] ?? "", said(told)));
    });
  }

  private tell(round: number, name: string, daemon: string, text: string): void {
    if (round !== this.round) return;
    this.answers.set(daemon, text);
    const several = this.answers.size > 1;
    const all = [...this.answers].map(([of, what]) => (several ? `${of}: ${what}` : what));
    put(this.said, `${name}: ${all.join("; ")}`);
  }
}

function said(answer: Answer): string {
  if (answer.phase === "not sent") return "NOT SENT, there is no connection";
  const time = `${(answer.tookMs / 1000).toFixed(2)} s`;
  if (answer.phase !== "result") return `${answer.phase}: ${answer.reason}`;
  const reason = answer.reason === answer.outcome ? "" : `, ${answer.reason}`;
  return `${answer.outcome}${reason} (${time})`;
}
