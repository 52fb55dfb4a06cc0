// MCUs that are not as they should be: what it is, and what to do. All of them above the overview,
// and that of the motor above a motor.
import { age } from "../logic/format";
import type { Mcu } from "../model/model";
import { mayCommand, type App } from "./app";
import { button, el, show } from "./dom";

const kMostLines = 8;

export class Trouble {
  readonly root = el("div", { class: "trouble", testid: "trouble", hidden: true });
  private shown = "";

  constructor(
    private readonly app: App,
    private readonly mcus: () => Mcu[],
  ) {
    this.update();
  }

  update(): void {
    const found = this.mcus()
      .map((mcu) => ({ mcu, text: this.words(mcu) }))
      .filter(({ text }) => text !== "");
    const may = mayCommand(this.app);
    const state = JSON.stringify([may, found.map(({ mcu, text }) => [mcu.key, text])]);
    if (state === this.shown) return;
    this.shown = state;
    const lines = found.slice(0, kMostLines).map(({ mcu, text }) => {
      const fault = isFault(mcu);
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
    const faults = found.filter(({ mcu }) => isFault(mcu));
    if (may && faults.length > 1) {
      lines.unshift(el("div", { class: "line error" }, el("span", { text: `${faults.length} MCUs have faults` }),
        button("Clear all faults", () => this.clearAll(faults.map(({ mcu }) => mcu.daemon)), {
          testid: "clear-all-faults",
        })));
    }
    if (found.length > kMostLines) {
      lines.push(el("div", { class: "line", text: `and ${found.length - kMostLines} more` }));
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

  private clearAll(daemons: string[]): void {
    for (const daemon of new Set(daemons)) {
      void this.app.requests.ask(daemon, "clear faults", { motors: [] });
    }
  }

  private clear(mcu: Mcu): void {
    void this.app.requests.ask(mcu.daemon, "clear faults", {
      motors: mcu.motors.map((motor) => motor.name),
    });
  }
}

function isFault(mcu: Mcu): boolean {
  return mcu.state?.state.toUpperCase() === "FAULT";
}
