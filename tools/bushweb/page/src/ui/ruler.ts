// Soft limits as a ruler: where the motor stands, and where it goes.
import { rulerOf } from "../logic/overview";
import { short } from "../logic/format";
import type { Motor } from "../model/model";
import { el, mark, put, show } from "./dom";

export class Ruler {
  private readonly way = el("div", { class: "way" });
  private readonly target = el("div", { class: "target" });
  private readonly at = el("div", { class: "at" });
  private readonly track = el("div", { class: "track" }, this.way, this.target, this.at);
  private readonly low = el("span", {});
  private readonly high = el("span", {});
  private readonly none = el("span", { class: "quiet", text: "no soft limits" });
  private readonly ends = el("div", { class: "ends" }, this.low, this.high);
  readonly root = el("div", { class: "ruler", testid: "ruler" }, this.track, this.ends, this.none);
  private drawn = "";

  update(motor: Motor): void {
    const marks = rulerOf(motor);
    const state = JSON.stringify(marks ?? null);
    if (state === this.drawn) return;
    this.drawn = state;
    show(this.track, marks !== undefined);
    show(this.ends, marks !== undefined);
    show(this.none, marks === undefined);
    if (!marks) return;
    put(this.low, short(marks.low, 6));
    put(this.high, short(marks.high, 6));
    show(this.at, marks.at !== undefined);
    if (marks.at !== undefined) this.at.style.transform = `translateX(${percent(marks.at)})`;
    const goes = marks.target !== undefined && marks.at !== undefined;
    show(this.target, goes);
    show(this.way, goes);
    if (marks.target !== undefined && marks.at !== undefined) {
      this.target.style.transform = `translateX(${percent(marks.target)})`;
      const from = Math.min(marks.at, marks.target);
      const length = Math.abs(marks.at - marks.target);
      this.way.style.transform = `translateX(${percent(from)}) scaleX(${length.toFixed(4)})`;
    }
    mark(this.track, "beyond", marks.beyond);
  }
}

function percent(share: number): string {
  return `${(share * 100).toFixed(2)}%`;
}
