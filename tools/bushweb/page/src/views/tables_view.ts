// Tables that the daemon finds: several over each other as curves, and the editor of one.
import uPlot from "uplot";
import { short } from "../logic/format";
import { curveOf, decelOf, groupsWith, isMirrored, speedOf } from "../logic/table";
import type { Changes } from "../model/model";
import type { TableEntry, TableFile } from "../net/messages";
import type { App, View } from "../ui/app";
import { button, choice, el, put, section, show } from "../ui/dom";
import { axis, fitWidth, seriesColour } from "../ui/plot_look";
import { TablePanel } from "../ui/table_panel";

const kHeight = 300;
const kMostCurves = 6;
const kColumns = ["Plot", "Table", "Revision", "Codes", "Start (steps/s)", "Max (steps/s)", "Groups", "Edit"];
const kNumbers = new Set(["Revision", "Codes", "Start (steps/s)", "Max (steps/s)"]);

export class TablesView implements View {
  readonly title = "Tables";
  readonly root: HTMLElement;
  private readonly said = el("p", { class: "quiet", role: "status" });
  private readonly rows = el("tbody", {});
  private readonly holder = el("div", { class: "plot", testid: "tables-plot" });
  private readonly daemons = el("div", { class: "fields" });
  private readonly editorPlace = el("div", {});
  private readonly files = new Map<string, TableFile>();
  private readonly chosen = new Set<string>();
  private groupCells: { table: string; cell: HTMLElement }[] = [];
  private daemon = "";
  private discards = ""; // the table for which somebody has been told what would be lost
  private plot: uPlot | undefined;
  private cleanup: () => void = () => {};
  private panel: TablePanel | undefined;
  private readonly curves: HTMLElement;

  constructor(private readonly app: App) {
    this.curves = section("Speed over steps from rest", this.holder);
    this.root = el(
      "div", { testid: "tables" }, el("h1", { text: "Tables" }), this.daemons,
      section("Tables of the daemon",
        el("div", { class: "buttons" }, button("Read again", () => void this.load())), this.said,
        el("div", { class: "wide table-list", tabindex: "0", role: "region", "aria-label": "Tables" },
          el("table", { class: "plain" }, el("thead", {}, el("tr", {},
            ...kColumns.map((text) =>
              el("th", { class: kNumbers.has(text) ? "number" : undefined, scope: "col", text })))),
          this.rows))),
      this.curves, this.editorPlace,
    );
    show(this.curves, false);
  }

  update(changes: Changes): void {
    if (!changes.structure && !changes.rights) return;
    const names = [...this.app.model.daemons.keys()];
    if (!names.includes(this.daemon)) {
      this.daemon = names[0] ?? "";
      this.daemons.replaceChildren();
      if (names.length > 1) {
        this.daemons.append(choice("Daemon", names.map((name) => [name, name]), this.daemon, (name) => {
          this.daemon = name;
          this.chosen.clear();
          this.files.clear();
          void this.load();
        }).root);
      }
      if (this.daemon !== "") void this.load();
    }
    this.writeGroups();
    this.panel?.update();
  }

  tick(): void {
    this.panel?.update();
  }

  close(): void {
    this.panel?.close();
    this.cleanup();
    this.plot?.destroy();
  }

  private async load(): Promise<void> {
    const answer = await this.app.requests.ask(this.daemon, "list tables", {}, { quiet: true });
    const entries = answer.detail.tables;
    put(this.said, entries ? `${entries.length} tables` : answer.reason);
    this.groupCells = [];
    this.rows.replaceChildren(...(entries ?? []).map((entry) => this.row(entry)));
    this.writeGroups();
    await this.draw();
  }

  // Which group has which table changes while the list is shown.
  private writeGroups(): void {
    const motors = [...(this.app.model.daemons.get(this.daemon)?.motors.values() ?? [])];
    for (const { table, cell } of this.groupCells) put(cell, groupsWith(motors, table).join(", "));
  }

  private row(entry: TableEntry): HTMLElement {
    const good = entry.fault === "";
    const box = el("input", {
      type: "checkbox", "aria-label": `Plot ${entry.name}`, checked: this.chosen.has(entry.name),
      disabled: !good, testid: `plot-${entry.name}`,
    });
    box.addEventListener("change", () => {
      if (box.checked) this.chosen.add(entry.name);
      else this.chosen.delete(entry.name);
      void this.draw();
    });
    const cells = good ? [
      String(entry.table?.revision ?? "–"), String(entry.codes ?? "–"),
      short(entry.start_steps_per_s, 5), short(entry.max_steps_per_s, 5),
    ] : [];
    const groups = el("td", {});
    if (good) this.groupCells.push({ table: entry.table?.name ?? "", cell: groups });
    return el(
      "tr", { class: good ? undefined : "bad", testid: `table-${entry.name}` },
      el("td", {}, box), el("th", { scope: "row", text: entry.name }),
      ...cells.map((text) => el("td", { class: "number", text })),
      good ? groups : el("td", { colspan: "5", text: entry.fault }),
      el("td", {}, good ? button("Edit", () => void this.edit(entry), { "aria-label": `Edit ${entry.name}` }) : null),
    );
  }

  private async file(name: string): Promise<TableFile | undefined> {
    const answer = await this.app.requests.ask(this.daemon, "get table", { table: name }, { quiet: true });
    const table = answer.detail.table;
    if (table) this.files.set(name, table);
    else put(this.said, answer.reason);
    return table;
  }

  private async draw(): Promise<void> {
    for (const name of this.chosen) if (!this.files.has(name)) await this.file(name);
    const tables = [...this.chosen].flatMap((name) => this.files.get(name) ?? []).slice(0, kMostCurves);
    this.cleanup();
    this.plot?.destroy();
    this.plot = undefined;
    show(this.curves, tables.length > 0);
    if (tables.length === 0) return;
    const curves = tables.flatMap((table, i) => {
      const falling = [...decelOf(table)].reverse().map((code) => speedOf(code, table.time_unit_ns));
      const up = { label: table.name, values: curveOf(table, "accel").speeds, dash: [] as number[], i };
      return isMirrored(table) ? [up]
        : [up, { label: `${table.name}, decelerating`, values: falling, dash: [5, 4], i }];
    });
    const longest = Math.max(...curves.map((curve) => curve.values.length));
    const x = Array.from({ length: longest }, (_, k) => k);
    this.plot = new uPlot({
      width: Math.max(this.holder.clientWidth, 200), height: kHeight,
      scales: { x: { time: false } }, cursor: { drag: { x: true, y: false } },
      axes: [{ ...axis("steps from rest"), size: 34 }, axis("steps/s")],
      series: [{ label: "step" }, ...curves.map((curve) => ({
        label: curve.label, stroke: seriesColour(curve.i), width: 1.5, dash: curve.dash,
        value: (_: uPlot, value: number | null) => (value === null ? "–" : short(value, 5)),
      }))],
    }, [x, ...curves.map((curve) => x.map((k) => curve.values[k] ?? curve.values[curve.values.length - 1] ?? null))],
    this.holder);
    this.cleanup = fitWidth(this.plot, this.holder, kHeight);
  }

  // `said`: what the editor says as it opens.
  private async edit(entry: TableEntry, said = ""): Promise<void> {
    // No dialog: while one is open, neither Esc nor the stop bar would stop anything.
    if (this.panel?.isChanged && this.discards !== entry.name) {
      this.discards = entry.name;
      put(this.said, "The table below has changes that are not saved. Press Edit again to discard them");
      return;
    }
    this.discards = "";
    const table = await this.file(entry.name);
    if (!table) return;
    this.panel?.close();
    const motors = [...(this.app.model.daemons.get(this.daemon)?.motors.values() ?? [])];
    const groups = [...new Set(motors.flatMap((motor) => motor.about?.group || []))];
    const panel = new TablePanel(this.app, this.daemon, entry.name, table, groups);
    panel.onSaved = (saved) => {
      this.files.clear();
      void this.load();
      this.panel?.close();
      this.panel = undefined;
      void this.edit(entry, saved);
    };
    this.panel = panel;
    this.editorPlace.replaceChildren(panel.root);
    panel.say(said);
    panel.start();
    panel.root.scrollIntoView({ block: "nearest" });
  }
}
