// MCUs that are not as they should be, above all motors: what it is, and what to do.
import { age } from "../logic/format";
import type { Mcu } from "../model/model";
import { mayCommand, type App } from "./app";
import { button, el, show } from "./dom";

export class Trouble {
  readonly root = el("div", { class: "trouble", testid: "trouble", hidden: true });
  private shown = "";

  constructor(private readonly app: App) {
    this.update();
  }

  update(): void {
    const found = this.app.model.allMcus()
      .map((mcu) => ({ mcu, text: this.words(mcu) }))
      .filter(({ text }) => text !== "");
    const may = mayCommand(this.app);
    const state = JSON.stringify([may, found.map(({ mcu, text }) => [mcu.key, text])]);
    if (state === this.shown) return;
    this.shown = state;
    const lines = found.slice(0, 8).map(({ mcu, text }) => {
      const fault = mcu.state?.state.toUpperCase() === "FAULT";
      return el(
        "div", { class: `line ${fault ? "error" : "warning"}` },
        el("span", { text: `MCU ${mcu.name}: ${text}` }),
        fault && may && mcu.motors.length > 0
          ? button("Clear faults", () => this.clear(mcu), {
            "aria-label": `Clear faults of MCU ${mcu.name}`, testid: "clear-faults",
          })
          : null,
      );
    });
    if (found.length > lines.length) {
      lines.push(el("div", { class: "line", text: `and ${found.length - lines.length} more` }));
    }
    this.root.replaceChildren(...lines);
    show(this.root, lines.length > 0);
  }

  private words(mcu: Mcu): string {
    const state = mcu.state;
    if (!state || mcu.about?.address === 0) return "";
    if (this.app.model.isOld(mcu)) {
      // By whole seconds here, so that screen readers are not told four times a second.
      const ageMs = this.app.model.ageMs(mcu);
      return `not heard for ${age(Math.max(1, Math.floor(ageMs / 1000)) * 1000).replace(".0", "")}`;
    }
    const parts: string[] = [];
    const word = state.state.toUpperCase();
    if (word === "OFFLINE" || word === "FAULT") {
      parts.push(word.toLowerCase());
      if (state.detail !== "") parts.push(state.detail);
    } else if (state.detail !== "") {
      parts.push(state.detail);
    }
    if (state.inputs.split(" ").includes("emergency")) parts.push("its emergency input is active");
    return parts.join(", ");
  }

  private clear(mcu: Mcu): void {
    void this.app.requests.ask(mcu.daemon, "clear faults", {
      motors: mcu.motors.map((motor) => motor.name),
    });
  }
}
