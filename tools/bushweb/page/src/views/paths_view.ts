import type { App, View } from "../ui/app";
import { el } from "../ui/dom";
export class PathsView implements View {
  readonly title = "Paths";
  readonly root = el("div", {}, el("h1", { text: "Paths" }));
  constructor(_app: App) {}
  update(): void {}
  tick(): void {}
  close(): void {}
}
