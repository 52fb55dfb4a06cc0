// Settings of a motor, and what differs from the file (`bushctl config`).
import type { Setting } from "../net/messages";
import type { Motor } from "../model/model";
import { isGood } from "../net/requests";
import { askMotor, mayCommand, type App } from "./app";
import { attribute, button, el, put, section, show } from "./dom";

export class MotorSettings {
  private readonly said = el("p", { class: "quiet", text: "Not read yet" });
  private readonly rows = el("tbody", {});
  private readonly table = el(
    "table", { class: "plain", hidden: true, testid: "settings" },
    el("thead", {}, el("tr", {},
      ...["Key", "Value", "In the file", ""].map((text) =>
        text === "" ? el("td", {}) : el("th", { scope: "col", text })))),
    this.rows,
  );
  readonly root = section("Settings", el("div", { class: "buttons" },
    button("Read again", () => void this.load())), this.said,
    el("div", { class: "wide", tabindex: "0", role: "region", "aria-label": "Settings" }, this.table));

  constructor(private readonly app: App, private readonly motor: Motor) {}

  async load(): Promise<void> {
    const answer = await askMotor(
      this.app, this.motor, "configure", { kind: 1, motors: [this.motor.name] }, { quiet: true },
    );
    const told = answer.detail.configuration;
    show(this.table, told !== undefined);
    if (!told) {
      put(this.said, answer.reason);
      return;
    }
    const settings = told.settings.filter((setting) => setting.motor === this.motor.name);
    const differ = settings.filter((setting) => setting.value !== setting.value_in_file).length;
    put(this.said, differ === 0
      ? `As in ${told.path}`
      : `${differ} of ${settings.length} differ from ${told.path}; "bushctl config --save" writes them into it`);
    this.rows.replaceChildren(...settings.map((setting) => this.row(setting)));
  }

  private row(setting: Setting): HTMLElement {
    const differs = setting.value !== setting.value_in_file;
    const input = el("input", {
      value: setting.value, "aria-label": `${setting.key} of ${this.motor.name}`, autocomplete: "off",
      disabled: !mayCommand(this.app),
    });
    const change = button("Change", () => void this.change(setting.key, input.value), {
      "aria-label": `Change ${setting.key}`, hidden: true,
    });
    input.addEventListener("input", () => {
      show(change, input.value !== setting.value);
      attribute(input, "aria-invalid", undefined);
    });
    return el(
      "tr", { class: differs ? "differs" : undefined, testid: `setting-${setting.key}` },
      el("th", { scope: "row", text: setting.key }), el("td", {}, input),
      el("td", { text: setting.value_in_file }),
      el("td", {}, differs ? el("span", { class: "mark", text: "differs" }) : null, change),
    );
  }

  private async change(key: string, value: string): Promise<void> {
    if (!mayCommand(this.app)) return;
    const answer = await askMotor(this.app, this.motor, "configure", {
      kind: 2, changes: [{ motor: this.motor.name, key, value }],
    });
    if (isGood(answer)) await this.load();
  }
}
