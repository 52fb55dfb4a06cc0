// A path from a file: what it would be, where it is refused, and running it.
import { CsvError } from "../logic/csv";
import { duration, noSpeed, parseSpeed, short } from "../logic/format";
import {
  located, parsePath, pathRequests, planeSpeeds, pointOf, type Corners, type Path,
} from "../logic/path";
import type { Changes, Motor } from "../model/model";
import type { MovePlan } from "../net/messages";
import { isGood, type Answer } from "../net/requests";
import { mayCommand, mayEnd, unitOf, type App, type View } from "../ui/app";
import { button, choice, el, field, put, section, show } from "../ui/dom";
import { Plane } from "../ui/plane";

const kMostBytes = 16 * 1024 * 1024;

export class PathsView implements View {
  readonly title = "Paths";
  readonly root: HTMLElement;
  private readonly said = el("p", { role: "status", testid: "path-said" });
  private readonly error = el("p", { class: "error-text", role: "alert", testid: "path-error" });
  private readonly plane = new Plane();
  private readonly axes = el("div", { class: "fields" });
  private readonly speed = field("No faster than (each motor's unit/s)", {
    inputmode: "decimal", placeholder: "as the tables", testid: "path-speed",
  });
  private readonly file = el("input", {
    type: "file", accept: ".csv,text/csv,text/plain", id: "path-file", testid: "path-file",
  });
  private readonly cornersChoice: HTMLSelectElement;
  private readonly check: HTMLButtonElement;
  private readonly run: HTMLButtonElement;
  private readonly pause: HTMLButtonElement;
  private readonly resume: HTMLButtonElement;
  private readonly stop: HTMLButtonElement;
  private readonly shown: HTMLElement;
  private corners: Corners = "continuous";
  private path: Path | undefined;
  private daemon = "";
  private plan: MovePlan | undefined;
  private refused: number | undefined;
  private x = 0;
  private y = 0;

  constructor(private readonly app: App) {
    this.file.addEventListener("change", () => {
      const [chosen] = this.file.files ?? [];
      if (chosen) void this.read(chosen);
      this.file.value = "";
    });
    const drop = el(
      "div", { class: "drop", testid: "path-drop" },
      el("label", { for: "path-file", text: "Drop a CSV file here, or choose one: " }), this.file,
      el("p", { class: "quiet", text:
        "The first line names motors of one bus, each further one has a position of each, in its " +
        "unit. For one motor a column \"speed\" may say how fast it goes to each point." }),
    );
    const over = (on: boolean) => (event: Event): void => {
      event.preventDefault();
      drop.classList.toggle("over", on);
    };
    drop.addEventListener("dragover", over(true));
    drop.addEventListener("dragleave", over(false));
    drop.addEventListener("drop", (event) => {
      over(false)(event);
      const [chosen] = event.dataTransfer?.files ?? [];
      if (chosen) void this.read(chosen);
    });
    const corners = choice("Corners", [
      ["continuous", "passed at the speed that tables allow"], ["exact", "rest at each point"],
    ], this.corners, (value) => { this.corners = value as Corners; void this.examine(); }, { testid: "corners" });
    this.cornersChoice = corners.select;
    this.speed.input.addEventListener("change", () => void this.examine());
    this.check = button("Check", () => void this.examine(), { testid: "path-check" });
    this.run = button("Run", () => void this.begin(), { testid: "path-run", class: "primary" });
    this.pause = button("Pause", () => this.ask("pause"), { testid: "path-pause" });
    this.resume = button("Resume", () => this.ask("resume"), { testid: "path-resume" });
    this.stop = button("Stop this path", () => this.ask("stop"), { class: "stop-one", testid: "path-stop" });
    this.shown = section("Path", this.said, this.error,
      el("div", { class: "fields" }, corners.root, this.speed.root),
      el("div", { class: "buttons" }, this.check, this.run, this.pause, this.resume, this.stop),
      this.axes, this.plane.root);
    this.root = el("div", { testid: "paths" }, el("h1", { text: "Paths" }), drop, this.shown);
    show(this.shown, false);
    this.writeButtons();
  }

  update(changes: Changes): void {
    if (changes.motors.size > 0 || changes.structure) {
      const [x, y] = [this.motor(this.x), this.motor(this.y)];
      if ((x && changes.motors.has(x)) || (y && changes.motors.has(y))) this.markNow();
    }
    this.writeButtons();
  }

  tick(): void {
    this.markNow();
    this.writeButtons();
  }

  close(): void {
    this.plane.close();
  }

  private motor(i: number): Motor | undefined {
    return this.app.model.find(this.daemon, this.path?.motors[i] ?? "");
  }

  private async read(file: File): Promise<void> {
    show(this.shown, true);
    if (this.app.paths.isRunning) {
      put(this.error, `${file.name} is not read: a path runs. Choose it again when that has ended`);
      return;
    }
    this.path = this.plan = this.refused = undefined;
    put(this.error, "");
    put(this.said, "");
    try {
      if (file.size > kMostBytes) throw new CsvError(`${file.name}: ${file.size} bytes; allowed: ${kMostBytes}`);
      const text = await file.text();
      const daemons = [...this.app.model.daemons.values()];
      const named = (name: string): boolean => daemons.some((daemon) => daemon.motors.has(name));
      const path = parsePath(text, file.name, named);
      const daemon = daemons.find((one) => path.motors.every((name) => one.motors.has(name))) ?? daemons[0];
      this.daemon = daemon?.name ?? "";
      this.path = path;
    } catch (error) {
      put(this.error, error instanceof CsvError ? error.message : `${file.name} cannot be read`);
      this.writeButtons();
      return;
    }
    this.x = 0;
    this.y = this.path.motors.length > 1 ? 1 : 0;
    this.writeAxes();
    this.draw();
    await this.examine();
  }

  private writeAxes(): void {
    const names: [string, string][] = (this.path?.motors ?? []).map((name, i) => [String(i), name]);
    this.axes.replaceChildren(
      choice("Horizontal", names, String(this.x), (value) => { this.x = Number(value); this.draw(); }).root,
      choice("Vertical", names, String(this.y), (value) => { this.y = Number(value); this.draw(); }).root,
    );
    show(this.axes, names.length > 2);
  }

  private draw(): void {
    const { path } = this;
    if (!path) return;
    const from = path.motors.map((_, i) => this.motor(i)?.state?.user_position ?? null);
    const unit = (i: number): string => {
      const motor = this.motor(i);
      return motor ? unitOf(motor) : "?";
    };
    const label = (i: number): string => `${path.motors[i] ?? ""} (${unit(i)})`;
    const units = new Set([unit(this.x), unit(this.y)]);
    const single = path.motors.length === 1;
    this.plane.draw({
      // One motor alone: its positions over the number of the point.
      points: path.rows.map((row, k) => single ? [k + 1, row[0] ?? 0] : [row[this.x] ?? 0, row[this.y] ?? 0]),
      from: single ? [0, from[0] ?? null] : [from[this.x] ?? null, from[this.y] ?? null],
      speeds: planeSpeeds(path.rows, from, this.plan?.points_us ?? [], this.x, this.y),
      xLabel: single ? "point" : label(this.x), yLabel: label(single ? 0 : this.y),
      speedUnit: units.size === 1 ? `${[...units][0]}/s` : "units/s",
      refused: this.refused,
    });
    this.markNow();
  }

  private markNow(): void {
    if (!this.path || this.path.motors.length === 1) return;
    const at = (i: number): number | null => {
      const motor = this.motor(i);
      // What is old is not shown as if it were there now.
      return motor && !this.app.model.isOld(motor.mcu) ? (motor.state?.user_position ?? null) : null;
    };
    this.plane.mark(at(this.x), at(this.y));
  }

  // Undefined, said why: it cannot be sent as it is.
  private parts(path: Path, dryRun: boolean): object[] | undefined {
    const text = this.speed.input.value.trim();
    const speed = parseSpeed(text);
    if (speed === undefined) {
      put(this.error, noSpeed(text));
      return undefined;
    }
    return pathRequests(path, { corners: this.corners, speed, dryRun });
  }

  private async send(path: Path, dryRun: boolean): Promise<Answer | undefined> {
    const parts = this.parts(path, dryRun);
    if (!parts) return undefined;
    const { daemon } = this;
    const ask = (fields: object): Promise<Answer> =>
      this.app.requests.ask(daemon, "move path", fields, { quiet: true });
    const answer = dryRun ? this.app.paths.check(parts, ask) : this.app.paths.run(parts, ask);
    this.writeButtons();
    return answer;
  }

  private async examine(): Promise<void> {
    const { path } = this;
    if (!path || this.app.paths.isRunning) return;
    // Run is of what was checked, and nothing else.
    this.plan = undefined;
    put(this.error, "");
    put(this.said, "");
    const sent = this.send(path, true);
    if (this.error.textContent === "") put(this.said, "Checking");
    const answer = await sent;
    this.writeButtons();
    if (!answer || path !== this.path) return;
    this.plan = isGood(answer) ? answer.detail.plan : undefined;
    this.tellRefusal(answer);
    const { plan } = this;
    put(this.said, plan
      ? `${path.rows.length} points of ${path.motors.join(", ")}: ${duration(plan.duration_us / 1e6)}` +
        (plan.limited_by ? `, limited by ${plan.limited_by}` : "") + `; ${peaks(plan)}`
      : "");
    this.draw();
    this.writeButtons();
  }

  private async begin(): Promise<void> {
    const { path } = this;
    if (!path || !mayCommand(this.app)) return;
    put(this.error, "");
    const answer = await this.send(path, false);
    this.writeButtons();
    if (!answer) return;
    this.tellRefusal(answer);
    const reason = located(path, answer.reason);
    const level = isGood(answer) ? "ok" : answer.outcome === "stopped" ? "warning" : "error";
    const why = reason === answer.outcome ? "" : `: ${reason}`;
    const text = `path ${path.file} ${answer.outcome || answer.phase}${why}`;
    this.app.log.add(level, text);
    this.app.notice(level, text);
    this.draw();
  }

  private tellRefusal(answer: Answer): void {
    if (!this.path) return;
    const bad = !isGood(answer);
    put(this.error, bad ? located(this.path, answer.reason) : "");
    const point = bad ? pointOf(answer.reason) : undefined;
    this.refused = point === undefined ? undefined : point - 1;
  }

  private ask(request: string): void {
    void this.app.requests.ask(this.daemon, request, { motors: this.path?.motors ?? [] });
  }

  private writeButtons(): void {
    const may = mayCommand(this.app) && this.path !== undefined;
    this.pause.disabled = !mayEnd(this.app) || this.path === undefined;
    this.resume.disabled = !may;
    const runs = this.app.paths.isRunning;
    this.run.disabled = !may || this.plan === undefined || runs;
    this.check.disabled = this.path === undefined || runs;
    this.file.disabled = this.cornersChoice.disabled = this.speed.input.disabled = runs;
    this.stop.disabled = this.path === undefined;
    const paused = this.path?.motors.some((_, i) => this.motor(i)?.state?.paused === true) === true;
    show(this.resume, paused);
    show(this.pause, !paused);
  }
}

function peaks(plan: MovePlan): string {
  return plan.motors.slice(0, 6)
    .map((motor) => `${motor.motor} up to ${short(motor.peak_steps_per_s, 5)} steps/s`).join(", ");
}
