// One side of a table as points that can be dragged, with the revision in service behind it and the
// places of diagnostics. Speed over steps; up is faster, which is a smaller code.
import uPlot from "uplot";
import { short } from "../logic/format";
import type { TableEditor } from "../logic/editor";
import { codeOf, decelOf, isMirrored, speedOf, type Side } from "../logic/table";
import type { Diagnostic, TableFile } from "../net/messages";
import { el } from "./dom";
import { axis, colour, fitWidth, seriesColour } from "./plot_look";

const kHeight = 300;

export class EditPlot {
  readonly root = el("div", {
    class: "plot", tabindex: "0", role: "application", "data-arrows": "", testid: "edit-plot",
    "aria-label": "Codes of the table as speeds. Left and right select a step, up and down change its code",
  });
  selected = 0;
  onSelect: () => void = () => {};
  onEdit: () => void = () => {};
  private plot: uPlot | undefined;
  private cleanup: () => void = () => {};
  private diagnostics: Diagnostic[] = [];
  private dragged: number | undefined; // the pointer's id

  constructor(
    private readonly editor: TableEditor,
    private side: Side,
    private readonly inService: () => TableFile | undefined,
  ) {
    this.root.addEventListener("keydown", (event) => this.takeKey(event));
  }

  start(): void {
    const plot = new uPlot({
      width: Math.max(this.root.clientWidth, 200), height: kHeight,
      scales: { x: { time: false } },
      cursor: { drag: { x: false, y: false } },
      axes: [{ ...axis("index of the code"), size: 34 }, axis("steps/s")],
      series: [
        { label: "index" },
        { label: "in service", stroke: seriesColour(1), width: 1, value: shown },
        { label: "edited", stroke: seriesColour(0), width: 1.5, points: { show: true, size: 6 }, value: shown },
      ],
      hooks: { draw: [(drawn) => this.drawMarks(drawn)] },
    }, this.data(), this.root);
    this.plot = plot;
    this.cleanup = fitWidth(plot, this.root, kHeight);
    plot.over.style.touchAction = "none";
    plot.over.addEventListener("pointerdown", (event) => this.grab(event));
    plot.over.addEventListener("pointermove", (event) => {
      if (this.dragged === event.pointerId) this.dragTo(event);
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"] as const) {
      plot.over.addEventListener(name, () => {
        if (this.dragged === undefined) return;
        this.dragged = undefined;
        this.editor.endDrag();
        this.onEdit();
      });
    }
  }

  close(): void {
    this.cleanup();
    this.plot?.destroy();
    this.plot = undefined;
  }

  show(side: Side, diagnostics: Diagnostic[]): void {
    this.side = side;
    this.diagnostics = diagnostics;
    this.selected = Math.min(this.selected, Math.max(this.editor.codes(side).length - 1, 0));
    // While a point is dragged the scale stays, or the point would run from under the pointer.
    this.plot?.setData(this.data(), this.dragged === undefined);
    if (this.dragged !== undefined) this.plot?.redraw(true);
  }

  select(index: number): void {
    const last = this.editor.codes(this.side).length - 1;
    this.selected = Math.min(Math.max(index, 0), Math.max(last, 0));
    this.plot?.redraw(false);
    this.onSelect();
  }

  private data(): uPlot.AlignedData {
    const { table } = this.editor;
    const speeds = (codes: readonly number[], unit: number): number[] =>
      codes.map((code) => speedOf(code, unit));
    const edited = speeds(this.editor.codes(this.side), table.time_unit_ns);
    const other = this.inService();
    const behind = other
      ? speeds(this.side === "accel" ? other.accel : decelOf(other), other.time_unit_ns) : [];
    const x = Array.from({ length: Math.max(edited.length, behind.length) }, (_, i) => i);
    return [x, x.map((i) => behind[i] ?? null), x.map((i) => edited[i] ?? null)];
  }

  private grab(event: PointerEvent): void {
    const { plot } = this;
    if (!plot || event.button !== 0) return;
    const at = Math.round(plot.posToVal(event.offsetX, "x"));
    if (this.editor.codes(this.side)[at] === undefined) return;
    this.root.focus();
    this.select(at);
    this.dragged = event.pointerId;
    plot.over.setPointerCapture(event.pointerId);
    this.editor.beginDrag();
  }

  private dragTo(event: PointerEvent): void {
    const speed = this.plot?.posToVal(event.offsetY, "y");
    if (speed === undefined) return;
    this.editor.dragCode(this.side, this.selected, codeOf(speed, this.editor.table.time_unit_ns));
    this.onEdit();
  }

  private takeKey(event: KeyboardEvent): void {
    const code = this.editor.codes(this.side)[this.selected] ?? 0;
    const step = event.shiftKey ? 10 : 1;
    const set = (value: number): void => {
      this.editor.setCode(this.side, this.selected, value);
      this.onEdit();
    };
    switch (event.key) {
      case "ArrowLeft": this.select(this.selected - step); break;
      case "ArrowRight": this.select(this.selected + step); break;
      case "Home": this.select(0); break;
      case "End": this.select(Infinity); break;
      case "ArrowUp": set(code - step); break;
      case "ArrowDown": set(code + step); break;
      default: return;
    }
    event.preventDefault();
  }

  private drawMarks(plot: uPlot): void {
    const { ctx } = plot;
    const unit = this.editor.table.time_unit_ns;
    const codes = this.editor.codes(this.side);
    const circle = (index: number, size: number, stroke: string): void => {
      const code = codes[index];
      if (code === undefined) return;
      ctx.strokeStyle = stroke;
      ctx.lineWidth = 2 * devicePixelRatio;
      ctx.beginPath();
      ctx.arc(plot.valToPos(index, "x", true), plot.valToPos(speedOf(code, unit), "y", true),
        size * devicePixelRatio, 0, 2 * Math.PI);
      ctx.stroke();
    };
    ctx.save();
    for (const found of this.diagnostics) {
      const here = found.side === this.side || (found.side === "decel" && isMirrored(this.editor.table));
      if (!here || found.index === null) continue;
      const index = found.side === this.side ? found.index : codes.length - 1 - found.index;
      circle(index, 7, colour(found.severity === "error" ? "bad" : "warn"));
    }
    circle(this.selected, 10, colour("accent"));
    ctx.restore();
  }
}

function shown(_: uPlot, value: number | null): string {
  return value === null ? "–" : short(value, 6);
}
