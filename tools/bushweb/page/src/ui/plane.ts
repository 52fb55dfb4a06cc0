// A path in the plane of two motors, with speed as colour, and where the motors are now.
import { fixed, short } from "../logic/format";
import { el } from "./dom";
import { colour } from "./plot_look";

export interface Drawn {
  points: [x: number, y: number][];
  from: [x: number | null, y: number | null];
  speeds: (number | null)[];
  xLabel: string;
  yLabel: string;
  speedUnit: string;
  refused: number | undefined; // index of the point
}

const kColours = ["#2c4a9a", "#1f8a8a", "#5a9a2a", "#c77d00", "#c0271d"];
const kMarginPx = 46;

export class Plane {
  private readonly still = el("canvas", { class: "plane", testid: "plane", role: "img" });
  private readonly live = el("canvas", { class: "plane over", "aria-hidden": "true" });
  private readonly legend = el("p", { class: "quiet", testid: "plane-legend" });
  readonly root = el("div", {}, el("div", { class: "stack" }, this.still, this.live), this.legend);
  private drawn: Drawn | undefined;
  private toX = (x: number): number => x;
  private toY = (y: number): number => y;
  private readonly resizes = new ResizeObserver(() => this.redraw());

  constructor() {
    this.resizes.observe(this.root);
  }

  draw(drawn: Drawn): void {
    this.drawn = drawn;
    this.still.setAttribute("aria-label",
      `Path of ${drawn.points.length} points in the plane of ${drawn.xLabel} and ${drawn.yLabel}`);
    this.redraw();
  }

  mark(x: number | null, y: number | null): void {
    const ctx = fit(this.live);
    if (!ctx || x === null || y === null || !this.drawn) return;
    ctx.strokeStyle = colour("accent");
    ctx.lineWidth = 2;
    ctx.beginPath();
    ctx.arc(this.toX(x), this.toY(y), 7, 0, 2 * Math.PI);
    ctx.moveTo(this.toX(x) - 11, this.toY(y));
    ctx.lineTo(this.toX(x) + 11, this.toY(y));
    ctx.moveTo(this.toX(x), this.toY(y) - 11);
    ctx.lineTo(this.toX(x), this.toY(y) + 11);
    ctx.stroke();
  }

  close(): void {
    this.resizes.disconnect();
  }

  private redraw(): void {
    const ctx = fit(this.still);
    const { drawn } = this;
    if (!ctx || !drawn) return;
    const { clientWidth: width, clientHeight: height } = this.still;
    const all = [...drawn.points];
    const [fromX, fromY] = drawn.from;
    if (fromX !== null && fromY !== null) all.push([fromX, fromY]);
    const [lowX, highX] = span(all.map(([x]) => x));
    const [lowY, highY] = span(all.map(([, y]) => y));
    const inner = { width: width - 2 * kMarginPx, height: height - 2 * kMarginPx };
    this.toX = (x) => kMarginPx + ((x - lowX) / (highX - lowX)) * inner.width;
    this.toY = (y) => height - kMarginPx - ((y - lowY) / (highY - lowY)) * inner.height;
    this.frame(ctx, drawn, [lowX, highX], [lowY, highY], height, width);
    const known = drawn.speeds.filter((speed): speed is number => speed !== null);
    const top = known.reduce((most, speed) => Math.max(most, speed), 0);
    let before = fromX !== null && fromY !== null ? ([fromX, fromY] as [number, number]) : undefined;
    ctx.lineWidth = 2;
    drawn.points.forEach((point, i) => {
      if (before) {
        const speed = drawn.speeds[i] ?? null;
        ctx.strokeStyle = speed === null ? colour("ink-soft") : colourOf(top > 0 ? speed / top : 0);
        ctx.setLineDash(i === 0 ? [4, 4] : []); // the way to the first point
        ctx.beginPath();
        ctx.moveTo(this.toX(before[0]), this.toY(before[1]));
        ctx.lineTo(this.toX(point[0]), this.toY(point[1]));
        ctx.stroke();
      }
      before = point;
    });
    ctx.setLineDash([]);
    const refused = drawn.refused === undefined ? undefined : drawn.points[drawn.refused];
    if (refused) {
      ctx.strokeStyle = colour("bad");
      ctx.lineWidth = 3;
      ctx.beginPath();
      ctx.arc(this.toX(refused[0]), this.toY(refused[1]), 9, 0, 2 * Math.PI);
      ctx.stroke();
    }
    this.writeLegend(known, top, drawn.speedUnit);
  }

  private frame(
    ctx: CanvasRenderingContext2D, drawn: Drawn, xs: [number, number], ys: [number, number],
    height: number, width: number,
  ): void {
    ctx.strokeStyle = colour("line");
    ctx.lineWidth = 1;
    ctx.strokeRect(kMarginPx, kMarginPx, width - 2 * kMarginPx, height - 2 * kMarginPx);
    ctx.fillStyle = colour("ink-soft");
    ctx.font = "12px system-ui, sans-serif";
    ctx.textAlign = "center";
    ctx.fillText(drawn.xLabel, width / 2, height - 12);
    ctx.textAlign = "left";
    ctx.fillText(short(xs[0], 5), kMarginPx, height - kMarginPx + 16);
    ctx.fillText(drawn.yLabel, kMarginPx, kMarginPx - 14);
    ctx.textAlign = "right";
    ctx.fillText(short(xs[1], 5), width - kMarginPx, height - kMarginPx + 16);
    ctx.fillText(short(ys[0], 5), kMarginPx - 5, height - kMarginPx);
    ctx.fillText(short(ys[1], 5), kMarginPx - 5, kMarginPx + 10);
  }

  private writeLegend(known: number[], top: number, unit: string): void {
    this.legend.replaceChildren();
    if (known.length === 0) {
      this.legend.append("Speeds are known after the check, of paths of at most 2048 points.");
      return;
    }
    this.legend.append("0 ");
    for (const one of kColours) {
      const box = el("span", { class: "swatch" });
      box.style.background = one;
      this.legend.append(box);
    }
    this.legend.append(` ${fixed(top, 3)} ${unit}, mean from point to point`);
  }
}

function fit(canvas: HTMLCanvasElement): CanvasRenderingContext2D | null {
  const width = Math.round(canvas.clientWidth * devicePixelRatio);
  const height = Math.round(canvas.clientHeight * devicePixelRatio);
  if (width === 0 || height === 0) return null;
  canvas.width = width; // also clears it
  canvas.height = height;
  const ctx = canvas.getContext("2d");
  ctx?.scale(devicePixelRatio, devicePixelRatio);
  return ctx;
}

// By a loop: a path may have more points than a call may have arguments.
function span(values: number[]): [number, number] {
  let low = Infinity;
  let high = -Infinity;
  for (const value of values) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (!(high > low)) return [low - 1, low + 1];
  const room = (high - low) * 0.04;
  return [low - room, high + room];
}

function colourOf(share: number): string {
  const at = Math.min(Math.max(share, 0), 1) * (kColours.length - 1);
  const i = Math.min(Math.floor(at), kColours.length - 2);
  const mix = (from: string, to: string): string => {
    const part = (k: number): number => {
      const a = parseInt(from.slice(k, k + 2), 16);
      const b = parseInt(to.slice(k, k + 2), 16);
      return Math.round(a + (b - a) * (at - i));
    };
    return `rgb(${part(1)} ${part(3)} ${part(5)})`;
  };
  return mix(kColours[i] ?? "#000000", kColours[i + 1] ?? "#000000");
}
