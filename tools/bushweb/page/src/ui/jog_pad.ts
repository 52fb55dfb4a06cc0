// Buttons and arrow keys that move a motor for as long as they are held.
import { HeldKey, Jog, kFocusLost, whyBlurred } from "../logic/jog";
import { beginsMotion } from "../logic/motion";
import { parseNumber, roundDown125, short } from "../logic/format";
import { recall, remember } from "../logic/persist";
import type { Motor } from "../model/model";
import { mayCommand, unitOf, type App } from "./app";
import { button, el, field, mark, put } from "./dom";

export class JogPad {
  private readonly speed: HTMLInputElement;
  private readonly label: HTMLElement;
  private readonly minus: HTMLButtonElement;
  private readonly plus: HTMLButtonElement;
  private readonly said = el("p", { class: "said quiet", testid: "jog-said", role: "status" });
  private readonly jog: Jog;
  private readonly heldKey = new HeldKey();
  readonly root: HTMLElement;

  private readonly endByBlur = (): void => this.end(kFocusLost);
  private readonly endByPage = (): void => this.end("the page is left");
  private readonly endIfHidden = (): void => {
    if (document.visibilityState === "hidden") this.end("the page is hidden");
  };
  private readonly keyDown = (event: KeyboardEvent): void => this.takeKey(event);
  private readonly keyUp = (event: KeyboardEvent): void => {
    if (this.heldKey.release(event.key)) this.jog.end("");
  };

  constructor(private readonly app: App, private readonly motor: Motor) {
    const speed = field("Jog speed", { inputmode: "decimal", testid: "jog-speed" });
    this.speed = speed.input;
    this.label = speed.label;
    const kept = recall<{ speeds: Record<string, string> }>("jog", { speeds: {} }).speeds[motor.key];
    this.speed.value = typeof kept === "string" ? kept : standardSpeed(motor);
    this.minus = this.holdButton("−", -1, "jog-minus", "Hold to move in the negative direction");
    this.plus = this.holdButton("+", 1, "jog-plus", "Hold to move in the positive direction");
    this.jog = new Jog({
      send: (fields, answered) => this.send(fields, answered),
      nowMs: () => performance.now(),
      every: (ms, run) => {
        const timer = setInterval(run, ms);
        return () => clearInterval(timer);
      },
    });
    this.jog.onChange = (state, why) => {
      if (!state) this.heldKey.clear();
      mark(this.minus, "held", state !== undefined && state.speed < 0);
      mark(this.plus, "held", state !== undefined && state.speed > 0);
      if (state) put(this.said, `moves at ${short(state.speed)} ${unitOf(motor)}/s while held`);
      else put(this.said, why === "" ? kHint : `ended: ${why}`);
    };
    this.root = el(
      "div", { class: "jog", testid: "jog" },
      el("div", { class: "pair" }, this.minus, this.plus), speed.root, this.said,
    );
    put(this.said, kHint);
    window.addEventListener("blur", this.endByBlur);
    window.addEventListener("pagehide", this.endByPage);
    document.addEventListener("visibilitychange", this.endIfHidden);
    document.addEventListener("freeze", this.endByPage);
    window.addEventListener("keydown", this.keyDown);
    window.addEventListener("keyup", this.keyUp);
    this.update();
  }

  update(): void {
    const may = mayCommand(this.app);
    this.minus.disabled = this.plus.disabled = !may;
    put(this.label, `Jog speed (${unitOf(this.motor)}/s)`);
    if (!this.app.connection.isOpen()) this.jog.lose();
    else if (this.app.connection.isSilent()) this.jog.end("bushd-web is silent");
    else if (!may) this.jog.end("this page may only read now");
  }

  end(why: string): void {
    this.heldKey.clear(); // also where the jog had not begun
    this.jog.end(why);
  }

  close(): void {
    this.end("another view");
    window.removeEventListener("blur", this.endByBlur);
    window.removeEventListener("pagehide", this.endByPage);
    document.removeEventListener("visibilitychange", this.endIfHidden);
    document.removeEventListener("freeze", this.endByPage);
    window.removeEventListener("keydown", this.keyDown);
    window.removeEventListener("keyup", this.keyUp);
  }

  private holdButton(
    text: string,
    sign: number,
    testid: string,
    label: string,
  ): HTMLButtonElement {
    const hold = button(text, () => {}, { class: "jog-button", testid, "aria-label": label });
    const letGo = (): void => this.end("");
    hold.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      event.preventDefault();
      hold.focus();
      try {
        hold.setPointerCapture(event.pointerId);
      } catch {
        return; // it was let go already
      }
      this.begin(sign);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture", "contextmenu"]) {
      hold.addEventListener(name, letGo);
    }
    hold.addEventListener("contextmenu", (event) => event.preventDefault());
    // The space bar or Enter on the button, held, as the pointer.
    hold.addEventListener("keydown", (event) => {
      if (event.key !== " " && event.key !== "Enter") return;
      event.preventDefault();
      this.heldKey.press(event.key, event.repeat, () => this.begin(sign));
    });
    hold.addEventListener("blur", () => this.end(whyBlurred(document.activeElement === hold)));
    return hold;
  }

  private takeKey(event: KeyboardEvent): void {
    const sign = event.key === "ArrowRight" ? 1 : event.key === "ArrowLeft" ? -1 : 0;
    if (event.key === "Escape") this.end("stop");
    if (sign === 0 || event.ctrlKey || event.altKey || event.metaKey) return;
    // Where an arrow key means something else.
    const at = event.target instanceof Element ? event.target : null;
    if (at?.closest("input, select, textarea, [data-arrows], .u-wrap")) return;
    if (!mayCommand(this.app)) return;
    event.preventDefault();
    this.heldKey.press(event.key, event.repeat, () => this.begin(sign));
  }

  private begin(sign: number): void {
    if (!mayCommand(this.app)) return;
    const speed = parseNumber(this.speed.value);
    if (speed === undefined || speed <= 0) {
      put(this.said, `"${this.speed.value}" is no speed; allowed: a number above 0, such as 2.5`);
      return;
    }
    const kept = recall<{ speeds: Record<string, string> }>("jog", { speeds: {} });
    remember("jog", { speeds: { ...kept.speeds, [this.motor.key]: this.speed.value } });
    this.jog.start(this.motor.name, sign * speed);
  }

  private send(fields: object, answered: (good: boolean, reason: string) => void): boolean {
    const { connection } = this.app;
    if (!connection.isOpen()) return false;
    // Nothing that moves; what ends a jog is always sent.
    if (beginsMotion("jog", fields) && connection.isSilent()) return false;
    const quiet = "renew" in fields;
    void this.app.requests
      .ask(this.motor.daemon, "jog", fields, { quiet, onAccepted: () => this.jog.accept() })
      .then((answer) => answered(answer.phase === "result", answer.reason));
    return true;
  }
}

const kHint = "Hold a button, or an arrow key ← →. It stops when let go.";

// A twentieth of the way between the limits in a second; without limits one unit, or 100 steps.
function standardSpeed(motor: Motor): string {
  const { about } = motor;
  if (about?.soft_limits && about.user_low !== null && about.user_high !== null) {
    return String(roundDown125((about.user_high - about.user_low) / 20));
  }
  return about?.unit === "steps" ? "100" : "1";
}
