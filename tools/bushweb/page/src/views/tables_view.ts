import type { App, View } from "../ui/app";
import { el } from "../ui/dom";
export class TablesView implements View {
  readonly title = "Tables";
  readonly root = el("div", {}, el("h1", { text: "Tables" }));
  constructor(_app: App) {}
  update(): void {}
  tick(): void {}
  close(): void {}
}
