// The table of a motor, speed over steps, with the place in the ramp where the motor is now: a mark
// above the plot, which is not drawn again for it.
import uPlot from "uplot";
import { short } from "../logic/format";
import { curveOf, decelOf, placeOf } from "../logic/table";
import type { Motor } from "../model/model";
import type { TableFile } from "../net/messages";
import { askMotor, type App } from "./app";
import { el, put, section, show } from "./dom";
import { axis, fitWidth, seriesColour } from "./plot_look";

const kHeight = 200;

export class RampPlot {
  private readonly said = el("p", { class: "quiet", testid: "ramp-place" });
  private readonly holder = el("div", { class: "plot" });
  private readonly mark = el("div", { class: "place", testid: "ramp-mark" });
  readonly root = section("Table", this.said, this.holder);
  private plot: uPlot | undefined;
  private cleanup: () => void = () => {};
  private table: TableFile | undefined;
  private asked = "";
  private at: { x: number; y: number } | undefined;

  constructor(private readonly app: App, private readonly motor: Motor) {}

  // Reads the table again if it is another by now.
  async load(): Promise<void> {
    const ref = this.motor.about?.table;
    if (!ref || ref.name === "") return;
    const wanted = ref.revision > 0 ? `${ref.name}@${ref.revision}` : ref.name;
    if (wanted === this.asked) return;
    this.asked = wanted;
    const answer = await askMotor(
      this.app, this.motor, "get table", { table: wanted }, { quiet: true },
    );
    const table = answer.detail.table;
    if (wanted !== this.asked) return;
    if (!table) {
      this.asked = "";
      put(this.said, `${wanted}: ${answer.reason}`);
      return;
    }
    this.table = table;
    this.draw(table);
    this.update();
  }

  update(): void {
    const { table, motor } = this;
    if (!table || !this.plot) return;
    const state = motor.state;
    const old = this.app.model.isOldMotor(motor);
    const left = state?.target_steps != null && state.position_steps != null && state.activity === "move"
      ? state.target_steps - state.position_steps : undefined;
    const place = state && !old ? placeOf(table, state.velocity_steps_per_s, left) : undefined;
    const name = `${table.name}${table.revision > 0 ? `, revision ${table.revision}` : ""}`;
    const ref = motor.about?.table;
    const scaled = ref && !table.hash.startsWith(ref.hash)
      ? "; the motor has it with another acceleration" : "";
    const words = place === undefined
      ? "at rest" : place.part === "cruise" ? "in cruise" : `${place.part}[${place.index}]`;
    put(this.said, `${name}${scaled}: ${old ? "nothing heard" : words}`);
    const accelSteps = table.accel.length;
    const speed = Math.abs(state?.velocity_steps_per_s ?? 0);
    this.at = place && {
      x: place.part === "decel" ? accelSteps + place.index : place.index, y: speed,
    };
    this.place();
  }

  close(): void {
    this.cleanup();
    this.plot?.destroy();
    this.plot = undefined;
  }

  private draw(table: TableFile): void {
    this.close();
    const up = curveOf(table, "accel");
    const down = curveOf(table, "decel");
    const count = up.steps.length + decelOf(table).length;
    const x = Array.from({ length: count }, (_, i) => i);
    const rising = x.map((i) => up.speeds[i] ?? null);
    const falling = x.map((i) => down.speeds[i - up.steps.length] ?? null);
    this.plot = new uPlot({
      width: Math.max(this.holder.clientWidth, 200), height: kHeight,
      scales: { x: { time: false } },
      cursor: { drag: { x: true, y: false } },
      axes: [{ ...axis("step of the ramps"), size: 34 }, axis("steps/s")],
      series: [
        { label: "step" },
        { label: "accelerating", stroke: seriesColour(0), width: 1.5, value: shown },
        { label: "decelerating", stroke: seriesColour(1), width: 1.5, value: shown },
      ],
      hooks: { draw: [() => this.place()] }, // after a zoom and in another width too
    }, [x, rising, falling], this.holder);
    this.plot.over.append(this.mark);
    this.cleanup = fitWidth(this.plot, this.holder, kHeight);
  }

  private place(): void {
    const { plot, at } = this;
    const isShown = plot !== undefined && at !== undefined && isWithin(plot, "x", at.x) && isWithin(plot, "y", at.y);
    show(this.mark, isShown);
    if (!isShown) return;
    const x = plot.valToPos(at.x, "x");
    const y = plot.valToPos(at.y, "y");
    this.mark.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  }
}

function isWithin(plot: uPlot, scale: string, value: number): boolean {
  const { min, max } = plot.scales[scale] ?? {};
  return min != null && max != null && min <= value && value <= max;
}

function shown(_: uPlot, value: number | null): string {
  return value === null ? "–" : short(value, 5);
}
