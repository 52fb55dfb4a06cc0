// What has moved a motor: when, who, from where to where, with which result.
import { writeCsv } from "../logic/csv";
import { dateTime } from "../logic/format";
import type { PastMotion } from "../net/messages";
import type { Motor } from "../model/model";
import { askMotor, type App } from "./app";
import { button, download, el, field, put, section, show } from "./dom";

const kShown = 50;
const kMost = 1000;

export class MotorHistory {
  private readonly said = el("p", { class: "quiet", text: "Not read yet" });
  private readonly rows = el("tbody", {});
  private readonly filter = field("Filter", { type: "search" });
  private readonly table = el(
    "table", { class: "plain", hidden: true, testid: "history" },
    el("thead", {}, el("tr", {}, ...["Time", "What", "From", "To", "Result", "Who"].map((text) =>
      el("th", { scope: "col", text })))),
    this.rows,
  );
  readonly root = section(
    "History",
    el("div", { class: "buttons" },
      button("Read again", () => void this.load()),
      button("Export CSV", () => void this.save(), { testid: "history-csv" }), this.filter.root),
    this.said, el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "History" }, this.table),
  );
  private motions: PastMotion[] = [];

  constructor(private readonly app: App, private readonly motor: Motor) {
    this.filter.input.addEventListener("input", () => this.draw());
  }

  async load(): Promise<void> {
    const motions = await this.read(kShown);
    if (!motions) return;
    this.motions = motions;
    put(this.said, motions.length === 0 ? "Nothing is kept of this motor" :
      motions.length < kShown ? "" : `The newest ${kShown}; the export has up to ${kMost}`);
    this.draw();
  }

  private draw(): void {
    const word = this.filter.input.value.toLowerCase();
    const shown = this.motions.filter((motion) =>
      word === "" || Object.values(motion).join(" ").toLowerCase().includes(word));
    show(this.table, this.motions.length > 0);
    this.rows.replaceChildren(...shown.map((motion) => el(
      "tr", { class: motion.outcome === "reached" || motion.outcome === "done" ? undefined : "bad" },
      ...[
        dateTime(motion.utime_us), motion.what, motion.from_text || `${motion.from_steps} steps`,
        motion.to_text || `${motion.to_steps} steps`,
        motion.reason && motion.reason !== motion.outcome
          ? `${motion.outcome}: ${motion.reason}` : motion.outcome,
        motion.who,
      ].map((text) => el("td", { text })),
    )));
  }

  private async read(most: number): Promise<PastMotion[] | undefined> {
    const answer = await askMotor(
      this.app, this.motor, "get history", { motor: this.motor.name, most }, { quiet: true },
    );
    if (!answer.detail.history) put(this.said, answer.reason);
    return answer.detail.history?.motions;
  }

  private async save(): Promise<void> {
    const motions = await this.read(kMost);
    if (!motions) return;
    download(`${this.motor.name}-history.csv`, historyCsv(this.motor.name, motions));
  }
}

export function historyCsv(motor: string, motions: PastMotion[]): string {
  return writeCsv(
    ["time_utc", "motor", "what", "from_steps", "to_steps", "from", "to", "outcome", "reason", "who"],
    motions.map((motion) => [
      new Date(motion.utime_us / 1000).toISOString(), motor, motion.what, motion.from_steps,
      motion.to_steps, motion.from_text, motion.to_text, motion.outcome, motion.reason, motion.who,
    ]),
  );
}
