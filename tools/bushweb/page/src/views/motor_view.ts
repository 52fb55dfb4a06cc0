// One motor: where it stands, what can be asked of it, plots, settings and history.
import { dateTime, duration, fixed, short } from "../logic/format";
import { stateWords } from "../logic/overview";
import type { Changes, Motor } from "../model/model";
import { ageOf, askMotor, precisionOf, unitOf, type App, type View } from "../ui/app";
import { attribute, el, mark, put, section, show } from "../ui/dom";
import { JogPad } from "../ui/jog_pad";
import { LivePlot } from "../ui/live_plot";
import { MotorCommands } from "../ui/motor_commands";
import { MotorHistory } from "../ui/motor_history";
import { inputsOf } from "../ui/motor_row";
import { MotorSettings } from "../ui/motor_settings";
import { RampPlot } from "../ui/ramp_plot";
import { userSpeed } from "../ui/recorder";
import { Ruler } from "../ui/ruler";
import { Trouble } from "../ui/trouble";

const kFacts = [
  "Target", "Speed", "State", "Inputs", "Dial", "Steps", "Line", "MCU", "Program", "Group", "Table",
] as const;

export class MotorView implements View {
  readonly title: string;
  readonly root: HTMLElement;
  private readonly position = el("span", { class: "number huge", testid: "position" });
  private readonly unit = el("span", { class: "unit", testid: "unit" });
  private readonly trust = el("span", { class: "trust", testid: "trust" });
  private readonly age = el("span", { class: "age", testid: "age" });
  private readonly reason = el("p", { class: "reason", testid: "reason" });
  private readonly about = el("p", { class: "quiet" });
  private readonly facts = new Map(kFacts.map((name) => [name, el("dd", { text: "–" })]));
  private readonly ruler = new Ruler();
  private readonly jog: JogPad;
  private readonly commands: MotorCommands;
  private readonly settings: MotorSettings;
  private readonly history: MotorHistory;
  private readonly ramp: RampPlot;
  private readonly plot: LivePlot;
  private readonly head: HTMLElement;
  private readonly trouble: Trouble;
  private wasMoving = false;
  private readonly redraw: ReturnType<typeof setInterval>;

  constructor(private readonly app: App, private readonly motor: Motor) {
    this.title = motor.name;
    this.jog = new JogPad(app, motor);
    this.commands = new MotorCommands(app, motor, () => {
      void askMotor(app, motor, "stop");
      this.jog.end("stop");
    });
    this.trouble = new Trouble(app, () => [motor.mcu]);
    this.settings = new MotorSettings(app, motor);
    this.history = new MotorHistory(app, motor);
    this.ramp = new RampPlot(app, motor);
    this.plot = new LivePlot(app.recorder.of(motor), unitOf(motor));
    const facts = el("dl", { class: "facts" });
    for (const [name, value] of this.facts) {
      value.dataset["testid"] = `fact-${name.toLowerCase()}`;
      facts.append(el("div", {}, el("dt", { text: name }), value));
    }
    this.head = el(
      "section", { class: "panel state", "aria-label": `State of ${motor.name}` },
      el("h1", { text: motor.name }), this.about,
      el("p", { class: "where" }, this.position, this.unit, this.trust, this.age),
      this.reason, this.ruler.root, facts,
    );
    this.root = el(
      "div", { class: "motor-view", testid: `view-${motor.name}`, "data-motor": motor.name },
      this.trouble.root,
      el("div", { class: "columns" },
        el("div", {}, this.head),
        el("div", {}, this.commands.root, section("Jog", this.jog.root))),
      section("Position and speed", this.plot.root),
      this.ramp.root, this.settings.root, this.history.root,
    );
    this.write();
    this.redraw = setInterval(() => {
      if (document.visibilityState === "visible") this.plot.update();
    }, 200);
    queueMicrotask(() => this.start());
  }

  update(changes: Changes): void {
    if (changes.structure || changes.rights) {
      this.commands.update();
      this.jog.update();
      void this.ramp.load();
    }
    if (changes.structure || changes.motors.has(this.motor) || changes.mcus.has(this.motor.mcu)) {
      this.write();
    }
  }

  tick(): void {
    this.writeAge();
    this.trouble.update();
    this.commands.update();
    this.jog.update();
  }

  close(): void {
    clearInterval(this.redraw);
    this.jog.close();
    this.plot.close();
    this.ramp.close();
  }

  private start(): void {
    if (!this.root.isConnected) return;
    this.plot.start();
    void this.ramp.load();
    void this.settings.load();
    void this.history.load();
  }

  private write(): void {
    const { motor } = this;
    const { state, about } = motor;
    const decimals = precisionOf(motor);
    const unit = unitOf(motor);
    put(this.about, about?.description ?? "");
    show(this.about, (about?.description ?? "") !== "");
    put(this.position, fixed(state?.user_position, decimals));
    put(this.unit, unit);
    attribute(this.trust, "data-trust", state?.trust ?? "unknown");
    put(this.trust, state?.trust ?? "not reported");
    put(this.reason, this.whyNotKnown());
    show(this.reason, this.reason.textContent !== "");
    const tell = (name: (typeof kFacts)[number], text: string): void => {
      const value = this.facts.get(name);
      if (value) put(value, text === "" ? "–" : text);
    };
    tell("Target", state ? `${fixed(state.user_target, decimals)} ${unit}` : "");
    tell("Speed", state
      ? `${short(userSpeed(motor), 4)} ${unit}/s (${short(state.velocity_steps_per_s, 5)} steps/s)` : "");
    tell("State", state ? stateWords(motor).join(", ") || "at rest" : "");
    tell("Inputs", inputsOf(motor));
    tell("Dial", state ? `${fixed(state.dial_position, decimals)} ${unit}` : "");
    tell("Steps", state?.position_steps === null ? "" : String(state?.position_steps ?? ""));
    tell("Line", state?.on_line
      ? `${Math.round((state.line_fraction ?? 0) * 100)} % made, ${duration(state.line_left_s)} left` : "");
    const mcu = motor.mcu;
    tell("MCU", `${mcu.name}, output ${about?.output ?? "–"}, ${mcu.state?.state ?? "not reported"}` +
      (mcu.state?.detail ? `: ${mcu.state.detail}` : ""));
    tell("Program", mcu.state?.program ?? "");
    tell("Group", about?.group ?? "");
    const table = about?.table;
    const revision = table && table.revision > 0 ? `, revision ${table.revision}` : "";
    tell("Table", table ? `${table.name}${revision}, ${table.hash}` : "");
    mark(this.head, "moving", state?.moving === true);
    this.ruler.update(motor);
    this.ramp.update();
    this.commands.update();
    this.writeAge();
    // What has just ended is in the history.
    const moving = state?.moving === true;
    if (this.wasMoving && !moving) {
      setTimeout(() => { if (this.root.isConnected) void this.history.load(); }, 700);
    }
    this.wasMoving = moving;
  }

  private whyNotKnown(): string {
    const state = this.motor.state;
    if (!state) return "";
    const heard = state.trust === "stale" && state.heard_utime_us
      ? `heard ${dateTime(state.heard_utime_us)}` : "";
    const armed = state.armed_by === "" ? "" : `armed by ${state.armed_by}`;
    return [state.uncertain_reason, heard, armed].filter((text) => text !== "").join("; ");
  }

  private writeAge(): void {
    const old = this.app.model.isOldMotor(this.motor);
    mark(this.root, "old", old);
    put(this.age, ageOf(this.app, this.motor));
    if (old) this.ramp.update();
  }
}
