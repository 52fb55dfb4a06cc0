// Position and speed over time, below each other. Zoom and pan stay while data come; "Follow" goes
// back to the last minute.
import uPlot from "uplot";
import { short } from "../logic/format";
import { kKeptS, type Ring } from "../model/ring";
import { nowS } from "./recorder";
import { attribute, button, el, mark } from "./dom";
import { axis, fitWidth, seriesColour } from "./plot_look";

const kWindowS = 60;
const kHeights = [220, 160];

export class LivePlot {
  readonly root: HTMLElement;
  private readonly plots: uPlot[] = [];
  private readonly cleanups: (() => void)[] = [];
  private readonly holders = kHeights.map(() => el("div", { class: "plot" }));
  private readonly followButton: HTMLButtonElement;
  private follows = true;
  private settingScale = false;
  private range: [number, number] = [0, 1];
  private seen = 0;

  constructor(private readonly ring: Ring, private readonly unit: string) {
    this.followButton = button("Follow", () => this.follow(true), { testid: "plot-follow" });
    const zoom = (factor: number) => (): void => this.zoom(factor);
    this.root = el(
      "div", { class: "live", testid: "live-plot" },
      el("div", { class: "buttons" }, this.followButton,
        button("Zoom in", zoom(0.5)), button("Zoom out", zoom(2)),
        button("◀", () => this.pan(-0.5), { "aria-label": "Earlier" }),
        button("▶", () => this.pan(0.5), { "aria-label": "Later" })),
      ...this.holders,
    );
    attribute(this.followButton, "aria-pressed", "true");
  }

  // After the root is in the document: plots need a width.
  start(): void {
    const endS = nowS();
    this.range = [endS - kWindowS, endS];
    const sync = { key: "live" };
    this.plots.push(
      this.make(0, [
        { label: "position", scale: "y", stroke: seriesColour(0), width: 1.5 },
        { label: "target", scale: "y", stroke: seriesColour(1), width: 1, dash: [4, 4] },
      ], this.unit, sync),
      this.make(1, [
        { label: "speed", scale: "y", stroke: seriesColour(2), width: 1.5 },
      ], `${this.unit}/s`, sync),
    );
    this.update(true);
  }

  // Five times a second, when there is something new or the window moves on.
  update(always = false): void {
    if (this.plots.length === 0) return;
    const stamp = this.ring.lastS();
    if (!always && !this.follows && stamp === this.seen) return;
    this.seen = stamp;
    if (this.follows) {
      const endS = nowS();
      this.range = [endS - (this.range[1] - this.range[0]), endS];
    }
    const [times, positions, targets, speeds] = this.ring.columns();
    this.plots[0]?.setData([times, positions, targets], false);
    this.plots[1]?.setData([times, speeds], false);
    this.apply();
  }

  close(): void {
    for (const cleanup of this.cleanups) cleanup();
    for (const plot of this.plots) plot.destroy();
    this.plots.length = 0;
  }

  private make(
    i: number,
    series: uPlot.Series[],
    label: string,
    sync: { key: string },
  ): uPlot {
    const holder = this.holders[i] ?? this.root;
    const height = kHeights[i] ?? 200;
    const plot = new uPlot({
      width: Math.max(holder.clientWidth, 200), height,
      cursor: { sync, drag: { x: true, y: false, setScale: true } },
      scales: { x: { time: true, auto: false }, y: { range: withRoom } },
      axes: [{ ...axis(""), size: 34, labelSize: 0, values: timeTicks }, axis(label)],
      series: [{ label: "time", value: (_, at) => (at === null ? "" : clock(at)) },
        ...series.map((one) => ({
          ...one, value: (_: uPlot, value: number | null) => (value === null ? "–" : short(value, 6)),
        }))],
      hooks: {
        setScale: [(self, key) => {
          if (key !== "x" || this.settingScale) return;
          const { min, max } = self.scales["x"] ?? {};
          if (min == null || max == null) return;
          this.range = [min, max];
          this.follow(false);
          this.apply();
        }],
      },
    }, [[], ...series.map(() => [])] as uPlot.AlignedData, holder);
    plot.over.addEventListener("wheel", (event) => {
      // Only with a key: the wheel alone scrolls the page.
      if (!event.ctrlKey && !event.shiftKey) return;
      event.preventDefault();
      if (event.shiftKey) this.pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
      else this.zoom(event.deltaY > 0 ? 1.25 : 0.8);
    }, { passive: false });
    // A double click is back to following, as in other plots to the whole.
    plot.over.addEventListener("dblclick", (event) => {
      event.stopImmediatePropagation();
      this.follow(true);
    }, { capture: true });
    this.cleanups.push(fitWidth(plot, holder, height));
    return plot;
  }

  private follow(on: boolean): void {
    if (on && !this.follows) this.range = [this.range[1] - kWindowS, this.range[1]];
    this.follows = on;
    attribute(this.followButton, "aria-pressed", String(on));
    mark(this.root, "zoomed", !on);
    if (on) this.update(true);
  }

  private zoom(factor: number): void {
    const [from, to] = this.range;
    const width = Math.min(Math.max((to - from) * factor, 0.5), kKeptS);
    this.range = this.follows ? [to - width, to] : centred((from + to) / 2, width);
    this.apply();
  }

  private pan(share: number): void {
    const [from, to] = this.range;
    const by = (to - from) * share;
    this.range = [from + by, to + by];
    this.follow(false);
    this.apply();
  }

  private apply(): void {
    this.settingScale = true;
    const [min, max] = this.range;
    for (const plot of this.plots) plot.setScale("x", { min, max });
    // uPlot sets scales in a microtask.
    queueMicrotask(() => queueMicrotask(() => { this.settingScale = false; }));
  }
}

function centred(middle: number, width: number): [number, number] {
  return [middle - width / 2, middle + width / 2];
}

// Never a flat line of full height by rounding.
function withRoom(_: uPlot, min: number | null, max: number | null): [number, number] {
  if (min === null || max === null || !Number.isFinite(min) || !Number.isFinite(max)) return [-1, 1];
  const room = Math.max((max - min) * 0.08, Math.abs(max) * 1e-6, 1e-6);
  return min === max ? [min - Math.max(room, 0.5), max + Math.max(room, 0.5)] : [min - room, max + room];
}

function clock(atS: number): string {
  const date = new Date(atS * 1000);
  const two = (n: number): string => String(n).padStart(2, "0");
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}`;
}

function timeTicks(_: uPlot, values: number[]): string[] {
  const [first = 0, second = first + 1] = values;
  const decimals = second - first >= 1 ? 0 : second - first >= 0.1 ? 1 : 2;
  return values.map((atS) => {
    const fraction = (atS - Math.floor(atS)).toFixed(decimals).slice(1);
    return clock(Math.floor(atS)) + fraction;
  });
}
