// What bushctl doctor finds, the log of this page, and the history of all motors as a file.
import { writeCsv } from "../logic/csv";
import type { Changes } from "../model/model";
import type { Finding } from "../net/messages";
import type { App, View } from "../ui/app";
import { button, download, el, put, section, show } from "../ui/dom";
import { withCode } from "../ui/first_start";
import { historyCsv } from "../ui/motor_history";

const kNoDaemon = "No daemon is known to this page";
const kRank = { error: 0, warning: 1, ok: 2 };

export class HealthView implements View {
  readonly title = "Health";
  readonly root: HTMLElement;
  private readonly said = el("p", { class: "quiet", role: "status", testid: "doctor-said" });
  private readonly findings = el("ul", { class: "findings", testid: "findings" });
  private readonly events = el("tbody", {});
  private readonly exported = el("p", { class: "quiet", role: "status" });
  private readonly first = el("p", { text: "Nothing has happened since the page was opened." });
  private logged = -1;
  private examined = false;

  constructor(private readonly app: App) {
    this.root = el(
      "div", { testid: "health" }, el("h1", { text: "Health" }),
      section("Doctor", el("div", { class: "buttons" },
        button("Examine again", () => void this.examine(), { testid: "doctor" })), this.said, this.findings),
      section("Log of this page", el("div", { class: "buttons" },
        button("Export CSV", () => this.saveLog(), { testid: "log-csv" })), this.first,
      el("div", { class: "wide log", tabindex: "0", role: "region", "aria-label": "Log of this page" },
        el("table", { class: "plain", testid: "log" },
          el("thead", {}, el("tr", {}, el("th", { class: "number", scope: "col", text: "Time" }),
            el("th", { scope: "col", text: "What" }))), this.events))),
      section("History of all motors",
        el("p", { class: "quiet", text: "Up to 1000 motions of each motor, as one CSV file." }),
        el("div", { class: "buttons" },
          button("Export CSV", () => void this.saveHistory(), { testid: "all-history-csv" })), this.exported),
    );
    put(this.said, "Waiting for what bushd-web says of daemons");
    this.drawLog();
  }

  update(_changes: Changes): void {
    // A page that was opened here knows none before bushd-web has said hello.
    const { daemons, hello } = this.app.model;
    if (!this.examined && daemons.size > 0) void this.examine();
    else if (!this.examined && hello) put(this.said, kNoDaemon);
    this.drawLog();
  }

  tick(): void {
    this.drawLog();
  }

  close(): void {}

  private async examine(): Promise<void> {
    const daemons = [...this.app.model.daemons.keys()];
    if (daemons.length === 0) {
      put(this.said, kNoDaemon);
      return;
    }
    this.examined = true;
    put(this.said, "Looking for some seconds");
    const answers = await Promise.all(
      daemons.map((daemon) => this.app.requests.call("doctor", { daemon })));
    const all = answers.flatMap((answer, i) =>
      answer.detail.findings
        ? answer.detail.findings.map((finding) => ({ daemon: daemons[i] ?? "", finding }))
        : [{ daemon: daemons[i] ?? "", finding: {
          level: "error", check: "doctor", seen: answer.reason, remedy: null } as Finding }]);
    all.sort((a, b) => kRank[a.finding.level] - kRank[b.finding.level]);
    const errors = all.filter(({ finding }) => finding.level === "error").length;
    const warnings = all.filter(({ finding }) => finding.level === "warning").length;
    put(this.said, `${counted(errors, "error")}, ${counted(warnings, "warning")}`);
    this.findings.replaceChildren(...all.map(({ daemon, finding }) => el(
      "li", { class: finding.level },
      el("strong", { text: finding.level }),
      el("span", { class: "check", text: daemons.length > 1 ? `${daemon}: ${finding.check}` : finding.check }),
      el("div", {}, el("span", { text: finding.seen }),
        finding.remedy ? el("p", { class: "remedy" }, ...withCode(finding.remedy)) : null),
    )));
  }

  private drawLog(): void {
    const { log } = this.app;
    if (log.added === this.logged) return;
    this.logged = log.added;
    show(this.first, log.events.length === 0);
    this.events.replaceChildren(...[...log.events].reverse().map((event) => el(
      "tr", { class: event.level === "error" ? "bad" : event.level },
      el("td", { class: "number", text: event.at.toLocaleTimeString() }), el("td", { text: event.text }),
    )));
  }

  private saveLog(): void {
    download("bushd-page-log.csv", writeCsv(["time_utc", "level", "what"],
      this.app.log.events.map((event) => [event.at.toISOString(), event.level, event.text])));
  }

  private async saveHistory(): Promise<void> {
    const motors = this.app.model.allMotors().filter((motor) => motor.mcu.about?.address !== 0);
    const parts: string[] = [];
    let missing = "";
    for (const [i, motor] of motors.entries()) {
      put(this.exported, `${i + 1} of ${motors.length}`);
      const answer = await this.app.requests.ask(
        motor.daemon, "get history", { motor: motor.name, most: 1000 }, { quiet: true });
      const told = answer.detail.history?.motions;
      if (!told) missing = `${motor.name}: ${answer.reason}`;
      else if (told.length > 0) parts.push(historyCsv(motor.name, told));
    }
    const [head = ""] = historyCsv("", []).split("\n", 1);
    put(this.exported, missing === "" ? `${motors.length} motors` : missing);
    const rows = parts.map((part) => part.slice(part.indexOf("\n") + 1));
    if (missing === "") download("bushd-history.csv", `${head}\n${rows.join("")}`);
  }
}

function counted(n: number, word: string): string {
  return `${n} ${word}${n === 1 ? "" : "s"}`;
}
