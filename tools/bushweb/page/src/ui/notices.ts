// What came of requests: the newest above the stop bar. Good news goes by itself; the rest stays
// until it is closed, or until newer ones take its place.
import { button, el } from "./dom";

const kMost = 4;
const kGoodMs = 6000;

export class Notices {
  readonly root = el("div", { class: "notices", role: "status", "aria-live": "polite" });

  add(level: "ok" | "warning" | "error", text: string): void {
    const notice = el(
      "div", { class: `notice ${level}`, testid: "notice" },
      el("span", { text }),
      button("×", () => notice.remove(), { class: "close", "aria-label": "Close this message" }),
    );
    this.root.append(notice);
    // Good news makes room first, so that a refusal is not pushed out by it.
    while (this.root.children.length > kMost) {
      (this.root.querySelector(".notice.ok") ?? this.root.firstElementChild)?.remove();
    }
    if (level === "ok") setTimeout(() => notice.remove(), kGoodMs);
  }
}
