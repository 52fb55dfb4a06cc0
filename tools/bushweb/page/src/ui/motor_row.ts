// One motor in the overview.
import { fixed } from "../logic/format";
import { stateWords } from "../logic/overview";
import type { Motor } from "../model/model";
import { ageOf, askMotor, mayStop, motorAddress, precisionOf, unitOf, type App } from "./app";
import { attribute, button, el, mark, put, show } from "./dom";
import { Ruler } from "./ruler";

export class MotorRow {
  private readonly star: HTMLButtonElement;
  private readonly about = el("span", { class: "about" });
  private readonly position = el("span", { class: "number", testid: "position" });
  private readonly unit = el("span", { class: "unit", testid: "unit" });
  private readonly target = el("span", { class: "goes", testid: "target" });
  private readonly trust = el("span", { class: "trust", testid: "trust" });
  private readonly reason = el("span", { class: "reason", testid: "reason" });
  private readonly age = el("span", { class: "age", testid: "age" });
  private readonly words = el("span", { class: "words", testid: "activity" });
  private readonly inputs = el("span", { class: "inputs", testid: "inputs" });
  private readonly ruler = new Ruler();
  private readonly stop: HTMLButtonElement;
  readonly root: HTMLElement;

  constructor(
    private readonly app: App,
    private readonly motor: Motor,
    isFavourite: (motor: Motor) => boolean,
    toggleFavourite: (motor: Motor) => void,
  ) {
    const { name } = motor;
    this.star = button("☆", () => {
      toggleFavourite(motor);
      this.setFavourite(isFavourite(motor));
    }, { class: "star" });
    this.stop = button("Stop", () => void askMotor(app, motor, "stop"), {
      class: "stop-one", testid: "stop-motor", "aria-label": `Stop ${name}`,
    });
    const cell = (kind: string, ...children: HTMLElement[]): HTMLElement =>
      el("div", { class: `cell ${kind}`, role: "cell" }, ...children);
    this.root = el(
      "div", { class: "row motor", role: "row", testid: `motor-${name}`, "data-motor": name },
      cell("c-name", this.star, el("a", { href: motorAddress(motor), text: name }), this.about),
      cell("c-position", this.position, this.unit, this.target),
      cell("c-trust", this.trust, this.age, this.reason),
      cell("c-words", this.words, this.inputs),
      cell("c-ruler", this.ruler.root),
      cell("c-stop", this.stop),
    );
    this.setFavourite(isFavourite(motor));
    this.update();
  }

  update(): void {
    const { motor } = this;
    const state = motor.state;
    put(this.about, motor.about?.description ?? "");
    put(this.position, fixed(state?.user_position, precisionOf(motor)));
    put(this.unit, unitOf(motor));
    const goes = state !== undefined && (state.moving || state.paused);
    put(this.target, goes ? `→ ${fixed(state.user_target, precisionOf(motor))}` : "");
    put(this.words, state ? stateWords(motor).join(", ") || "at rest" : "");
    put(this.inputs, inputsOf(motor));
    attribute(this.trust, "data-trust", state?.trust ?? "unknown");
    put(this.trust, state?.trust ?? "not reported");
    const why = [state?.uncertain_reason, state?.armed_by ? `armed by ${state.armed_by}` : ""]
      .filter((text) => text).join("; ");
    put(this.reason, why);
    attribute(this.reason, "title", why === "" ? undefined : why);
    mark(this.root, "moving", state?.moving === true);
    this.ruler.update(motor);
    this.tick();
  }

  // Ages go on while nothing is heard.
  tick(): void {
    mark(this.root, "old", this.app.model.isOldMotor(this.motor));
    put(this.age, ageOf(this.app, this.motor));
    show(this.stop, mayStop(this.app));
  }

  private setFavourite(on: boolean): void {
    put(this.star, on ? "★" : "☆");
    attribute(this.star, "aria-pressed", on ? "true" : "false");
    attribute(this.star, "aria-label", `Favourite: ${this.motor.name}`);
  }
}

// Switches that are active, and what they inhibit.
export function inputsOf(motor: Motor): string {
  const state = motor.state;
  if (!state) return "";
  const parts: string[] = [];
  if (state.inputs !== "") parts.push(`inputs: ${state.inputs}`);
  else if (state.input) parts.push("input active");
  if (state.inhibited !== "") parts.push(`inhibited: ${state.inhibited}`);
  return parts.join("; ");
}
