// All motors, by group or MCU. Only rows in view are in the document.
import {
  sections, type Grouping, type Layout, type Sorting,
} from "../logic/overview";
import { recall, remember } from "../logic/persist";
import type { Changes, Motor } from "../model/model";
import type { App, View } from "../ui/app";
import { button, choice, el, field, put, show, attribute } from "../ui/dom";
import { FirstStart } from "../ui/first_start";
import { MotorRow } from "../ui/motor_row";
import { Trouble } from "../ui/trouble";
import { VirtualList, type Item, type Row } from "../ui/virtual_list";

const kStandard: Layout = {
  grouping: "group", sorting: "config", filter: "", onlyFavourites: false, favourites: [],
};
const kTitlePx = 36;
const kRowPx = 64;
const kNarrowRowPx = 124; // as in page.css
const kPauseOfRowMs = 25; // of each row that changed: more of them may be drawn less often
const kMostPauseMs = 180;

class Title implements Row {
  readonly root: HTMLElement;

  constructor(text: string) {
    this.root = el(
      "div", { class: "row title", role: "row" },
      el("div", { class: "cell", role: "cell" }, el("h2", { text })),
    );
  }
}

export class Overview implements View {
  readonly title = "Motors";
  readonly root: HTMLElement;
  private layout: Layout;
  private readonly list: VirtualList<Motor | string, MotorRow | Title>;
  private readonly table: HTMLElement;
  private readonly count = el("span", { class: "quiet", testid: "motor-count" });
  private readonly first: FirstStart;
  private readonly trouble: Trouble;
  private readonly tools: HTMLElement;
  private touched = 0; // rows, by the last update
  private readonly narrow = matchMedia("(max-width: 760px)");
  private readonly rebuild = (): void => this.arrange();

  constructor(private readonly app: App) {
    this.layout = recall("layout", kStandard);
    if (!Array.isArray(this.layout.favourites)) this.layout.favourites = [];
    if (typeof this.layout.filter !== "string") this.layout.filter = "";
    this.first = new FirstStart(app);
    this.trouble = new Trouble(app, () => app.model.allMcus());
    this.list = new VirtualList<Motor | string, MotorRow | Title>(app.scroller, (value) =>
      typeof value === "string"
        ? new Title(value)
        : new MotorRow(app, value, (motor) => this.isFavourite(motor), (motor) => this.toggle(motor)),
    );
    this.table = el(
      "div", { class: "motors", role: "table", "aria-label": "Motors" },
      el(
        "div", { class: "row head", role: "row", "aria-rowindex": "1" },
        ...["Motor", "Position", "Trust", "State", "Soft limits", "Stop"].map((text, i) =>
          el("div", { class: `cell h-${i}`, role: "columnheader", text })),
      ),
      this.list.root,
    );
    this.tools = this.makeTools();
    this.root = el(
      "div", { class: "overview" },
      el("h1", { class: "unseen", text: "Motors" }),
      this.first.root, this.trouble.root, this.tools, this.table,
    );
    this.narrow.addEventListener("change", this.rebuild);
    this.arrange();
  }

  update(changes: Changes): void {
    let touched = 0;
    if (changes.structure || changes.rights) {
      this.first.update();
      this.arrange();
      for (const [, row] of this.list.shown()) if (row instanceof MotorRow) row.update();
    } else {
      if (this.layout.sorting === "state" && changes.motors.size > 0) this.arrangeSoon();
      for (const motor of changes.motors) {
        const row = this.list.row(motor.key);
        if (!(row instanceof MotorRow)) continue;
        row.update();
        touched += 1;
      }
    }
    this.touched = touched;
    if (changes.mcus.size > 0 || changes.structure) this.trouble.update();
  }

  tick(): void {
    this.first.update();
    this.trouble.update();
    for (const [, row] of this.list.shown()) if (row instanceof MotorRow) row.tick();
  }

  // Many motors in motion are drawn five times a second, few as often as they report.
  pauseMs(): number {
    return Math.min(this.touched * kPauseOfRowMs, kMostPauseMs);
  }

  close(): void {
    this.narrow.removeEventListener("change", this.rebuild);
    this.list.close();
    clearTimeout(this.soon);
  }

  private soon: ReturnType<typeof setTimeout> | undefined;

  // An order by state changes at most once a second, so that rows can be aimed at.
  private arrangeSoon(): void {
    this.soon ??= setTimeout(() => {
      this.soon = undefined;
      this.arrange();
    }, 1000);
  }

  private arrange(): void {
    const { app, layout } = this;
    const all = app.model.allMotors();
    const rowPx = this.narrow.matches ? kNarrowRowPx : kRowPx;
    const items: Item<Motor | string>[] = [];
    let shown = 0;
    for (const section of sections(all, layout, app.model.daemons.size > 1)) {
      if (section.title !== "") {
        items.push({ key: `title ${section.title}`, height: kTitlePx, value: section.title });
      }
      for (const motor of section.motors) {
        items.push({ key: motor.key, height: rowPx, value: motor });
        shown += 1;
      }
    }
    show(this.table, all.length > 0);
    show(this.tools, all.length > 0);
    put(this.count, shown === all.length ? `${all.length} motors` : `${shown} of ${all.length} motors`);
    attribute(this.table, "aria-rowcount", String(items.length + 1));
    this.list.set(items);
  }

  private makeTools(): HTMLElement {
    const filter = field("Filter", {
      type: "search", testid: "filter", placeholder: "name, m0[1-4], @group",
    });
    filter.input.value = this.layout.filter;
    filter.input.addEventListener("input", () => this.change({ filter: filter.input.value }));
    const grouping = choice(
      "Group by", [["group", "group"], ["mcu", "MCU"], ["none", "nothing"]], this.layout.grouping,
      (value) => this.change({ grouping: value as Grouping }), { testid: "grouping" },
    );
    const sorting = choice(
      "Sort by", [["config", "configuration"], ["name", "name"], ["state", "state"]],
      this.layout.sorting, (value) => this.change({ sorting: value as Sorting }),
      { testid: "sorting" },
    );
    const favourites = button("★ only", () => {
      this.change({ onlyFavourites: !this.layout.onlyFavourites });
      attribute(favourites, "aria-pressed", String(this.layout.onlyFavourites));
    }, {
      testid: "favourites", "aria-pressed": String(this.layout.onlyFavourites),
      "aria-label": "Only favourites",
    });
    return el(
      "div", { class: "tools" }, filter.root, grouping.root, sorting.root, favourites, this.count,
    );
  }

  private change(change: Partial<Layout>): void {
    this.layout = { ...this.layout, ...change };
    remember("layout", this.layout);
    this.arrange();
  }

  private isFavourite(motor: Motor): boolean {
    return this.layout.favourites.includes(motor.key);
  }

  private toggle(motor: Motor): void {
    const without = this.layout.favourites.filter((key) => key !== motor.key);
    const had = without.length < this.layout.favourites.length;
    this.change({ favourites: had ? without : [...without, motor.key] });
  }
}
