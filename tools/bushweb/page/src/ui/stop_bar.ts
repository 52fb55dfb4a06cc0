// STOP on every view. Esc and the button ramp down all motors of all daemons, at once and without a
// question. Emergency stop is elsewhere and looks different: it latches until faults are cleared.
import type { App } from "./app";
import { button, el, mark, put } from "./dom";
import { kUnansweredMs, StopRound } from "../logic/stop_round";
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
  private round: StopRound | undefined;

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
    const alarm = this.round?.isAlarm(this.app.nowMs()) === true;
    mark(this.root, "cut", !open || nobody || alarm);
    put(this.stopButton,
      !open ? "STOP CANNOT BE SENT" : nobody ? "STOP REACHES NO DAEMON" : "STOP all motors");
    const may = this.app.model.hello?.may_stop ?? true;
    const state = !open ? "No connection to bushd-web. Use the emergency stop of the machine, or bushctl stop."
      : nobody ? "No daemon is connected. If motors move, use the emergency stop of the machine."
        : may ? "Esc stops too" : "This page may not stop motors: it has no token";
    // What came of the last stop stays until the state is another; that nobody has answered it,
    // until somebody does, or another stop is.
    if (state !== this.state && !alarm) this.round = undefined;
    this.state = state;
    put(this.said, open && this.round ? this.round.words(this.app.nowMs()) : state);
  }

  private ask(request: string, fields: object, name: string): void {
    const daemons = [...this.app.model.daemons.keys()];
    if (daemons.length === 0) {
      this.round = undefined;
      put(this.said, `${name}: not sent, as no daemon is known to this page`);
      return;
    }
    const sentMs = this.app.nowMs();
    const tell = (daemon: string, text: string, answered: boolean): void => {
      round?.tell(daemon, text, answered);
      this.update();
    };
    let round: StopRound | undefined;
    // All are sent before anything is waited for or drawn.
    const asked = daemons.map((daemon) => this.app.requests.ask(daemon, request, fields, {
      onAccepted: () => tell(daemon, "accepted, motors ramp down", true),
    }));
    round = this.round = new StopRound(name, daemons, sentMs, (daemon) => this.app.model.isDeaf(daemon));
    this.update();
    setTimeout(() => this.update(), kUnansweredMs);
    asked.forEach((answer, i) => {
      void answer.then((told) =>
        tell(daemons[i] ?? "", said(told), told.phase === "result" || told.phase === "refused"));
    });
  }
}

function said(answer: Answer): string {
  if (answer.phase === "not sent") return "NOT SENT, there is no connection";
  const time = `${(answer.tookMs / 1000).toFixed(2)} s`;
  if (answer.phase !== "result") return `${answer.phase}: ${answer.reason}`;
  const reason = answer.reason === answer.outcome ? "" : `, ${answer.reason}`;
  return `${answer.outcome}${reason} (${time})`;
}
