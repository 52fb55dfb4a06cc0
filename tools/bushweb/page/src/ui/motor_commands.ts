// What can be asked of a motor from its view: go to, by, stop, pause, home, set, confirm, hold.
import { noSpeed, parseNumber, parseSpeed } from "../logic/format";
import type { Motor } from "../model/model";
import { askMotor, mayCommand, mayEnd, unitOf, type App } from "./app";
import { button, el, field, put, section, show, attribute } from "./dom";

type Field = ReturnType<typeof field>;

export class MotorCommands {
  readonly root: HTMLElement;
  private readonly goTo: Field;
  private readonly by: Field;
  private readonly atSpeed: Field;
  private readonly set: Field;
  private readonly said = el("p", { class: "said error-text", role: "alert", testid: "input-error" });
  private readonly guarded: [HTMLButtonElement, may: (app: App) => boolean][] = [];
  private readonly pause: HTMLButtonElement;
  private readonly resume: HTMLButtonElement;
  private readonly hold: HTMLButtonElement;
  private readonly release: HTMLButtonElement;
  private readonly confirm: HTMLButtonElement;

  constructor(private readonly app: App, private readonly motor: Motor, stop: () => void) {
    const number = { inputmode: "decimal" };
    this.goTo = field("Go to", { ...number, testid: "goto-input" });
    this.by = field("Move by", { ...number, testid: "by-input" });
    this.atSpeed = field("No faster than", {
      ...number, testid: "speed-input", placeholder: "as its table",
    });
    this.set = field("It stands at (dial)", { ...number, testid: "set-input" });
    const go = this.guard("Go", () => this.move(this.goTo.input, 2), "goto");
    const byPlus = this.guard("By +", () => this.move(this.by.input, 1), "by");
    const byMinus = this.guard("By −", () => this.move(this.by.input, 1, -1), "by-minus");
    onEnter(this.goTo.input, () => this.move(this.goTo.input, 2));
    onEnter(this.by.input, () => this.move(this.by.input, 1));
    const ask = (request: string) => (): void => void askMotor(app, motor, request);
    this.pause = this.guard("Pause", ask("pause"), "pause", mayEnd);
    this.resume = this.guard("Resume", ask("resume"), "resume");
    this.hold = this.guard("Hold", ask("hold"), "hold", mayEnd);
    this.release = this.guard("Release", ask("release"), "release");
    this.confirm = this.guard("Confirm position", ask("confirm"), "confirm");
    const home = this.guard("Home", ask("home"), "home");
    const setDial = this.guard("Set position", () => this.setPosition(), "set");
    onEnter(this.set.input, () => this.setPosition());
    const enable = this.guard("Enable drivers", ask("enable"), "enable");
    const disable = this.guard("Disable drivers", ask("disable"), "disable");
    const stopOne = button(`Stop ${motor.name}`, stop, {
      class: "stop-one", testid: "stop-motor",
    });
    this.root = section(
      "Move",
      el("div", { class: "fields" },
        this.goTo.root, go, this.by.root, byMinus, byPlus, this.atSpeed.root),
      this.said,
      el("div", { class: "buttons" }, stopOne, this.pause, this.resume, home),
      el("details", { class: "more", testid: "more-commands" },
        el("summary", { text: "Position, hold and drivers" }),
        el("p", { class: "quiet", text:
          "Set the current position without moving, or confirm that the motor stands where it is " +
          "shown. A hold lets no motion begin until it is released." }),
        el("div", { class: "fields" }, this.set.root, setDial),
        el("div", { class: "buttons" }, this.confirm, this.hold, this.release, enable, disable)),
    );
    this.update();
  }

  update(): void {
    for (const [one, may] of this.guarded) {
      const disabled = !may(this.app);
      if (one.disabled !== disabled) one.disabled = disabled;
    }
    const unit = unitOf(this.motor);
    put(this.goTo.label, `Go to (${unit})`);
    put(this.by.label, `Move by (${unit})`);
    put(this.atSpeed.label, `No faster than (${unit}/s)`);
    put(this.set.label, `It stands at (dial, ${unit})`);
    const state = this.motor.state;
    show(this.resume, state?.paused === true);
    show(this.pause, state?.paused !== true);
    show(this.release, state?.held === true);
    show(this.hold, state?.held !== true);
    // A position that is known needs no confirmation.
    show(this.confirm, state !== undefined && state.trust !== "known");
  }

  private guard(text: string, run: () => void, testid: string, may = mayCommand): HTMLButtonElement {
    const made = button(text, () => {
      if (may(this.app)) run();
    }, { testid });
    this.guarded.push([made, may]);
    return made;
  }

  private read(input: HTMLInputElement): number | undefined {
    const value = parseNumber(input.value);
    attribute(input, "aria-invalid", value === undefined ? "true" : undefined);
    put(this.said, value !== undefined ? "" :
      input.value.trim() === "" ? "Type a number first" :
        `"${input.value}" is no number; allowed: a decimal number such as -12.5`);
    if (value === undefined) input.focus();
    return value;
  }

  private move(input: HTMLInputElement, kind: 1 | 2, sign = 1): void {
    if (!mayCommand(this.app)) return;
    const value = this.read(input);
    if (value === undefined) return;
    const typed = this.atSpeed.input;
    const speed = parseSpeed(typed.value);
    attribute(typed, "aria-invalid", speed === undefined ? "true" : undefined);
    if (speed === undefined) {
      put(this.said, noSpeed(typed.value));
      typed.focus();
      return;
    }
    void askMotor(this.app, this.motor, "move", {
      kind, speed, speed_in_steps: false,
      motors: [{ motor: this.motor.name, in_steps: false, user: sign * value }],
    });
  }

  private setPosition(): void {
    if (!mayCommand(this.app)) return;
    const value = this.read(this.set.input);
    if (value === undefined) return;
    void askMotor(this.app, this.motor, "set position", {
      dial: true, motors: [{ motor: this.motor.name, in_steps: false, user: value }],
    });
  }
}

function onEnter(input: HTMLInputElement, run: () => void): void {
  input.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && !event.repeat) run();
  });
}
