// Editor of a table: codes by dragging or typing, what the checker says of them, what differs from
// the revision in service, saving as the next revision, and putting it in service.
import { TableEditor } from "../logic/editor";
import { duration, parseNumber, short } from "../logic/format";
import { codeOf, diffOf, isMirrored, moveTimeS, servedRevision, speedOf, tooLong, type Side } from "../logic/table";
import type { Diagnostic, TableFile } from "../net/messages";
import { isGood } from "../net/requests";
import { mayCommand, type App } from "./app";
import { attribute, button, choice, el, field, put, show } from "./dom";
import { EditPlot } from "./edit_plot";

const kCheckAfterMs = 300;
const kShownChanges = 200;
const kAskAgainMs = 5000;

export class TablePanel {
  readonly root = el("section", { class: "panel", testid: "table-editor" });
  onSaved: (said: string) => void = () => {};
  private readonly editor: TableEditor;
  private readonly plot: EditPlot;
  private side: Side = "accel";
  private diagnostics: Diagnostic[] = [];
  private checks = 0;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private inService: TableFile | undefined;
  private compared: number | undefined; // the revision of inService, from when it is asked for
  private readonly index = field("Index", { type: "number", min: "0", testid: "code-index" });
  private readonly code = field("Code", { type: "number", min: "1", max: "65535", testid: "code" });
  private readonly speed = field("Speed (steps/s)", { inputmode: "decimal", testid: "code-speed" });
  private readonly name = field("Save as", { testid: "save-name" });
  private readonly said = el("p", { role: "status", testid: "table-said" });
  private readonly messages = el("ul", { class: "messages", testid: "diagnostics" });
  private readonly difference = el("summary", { testid: "diff" });
  private readonly changes = el("tbody", {});
  private readonly undo: HTMLButtonElement;
  private readonly redo: HTMLButtonElement;
  private readonly mirror: HTMLButtonElement;
  private readonly save: HTMLButtonElement;
  private readonly use: HTMLButtonElement;
  private readonly sides: HTMLSelectElement;
  private readonly times = el("p", { class: "quiet" });
  private group = "";
  private loaded: TableFile;

  constructor(
    private readonly app: App,
    private readonly daemon: string,
    private readonly file: string, // name by which the daemon finds it
    table: TableFile,
    groups: string[],
  ) {
    this.loaded = table;
    this.editor = new TableEditor(table);
    this.plot = new EditPlot(this.editor, this.side, () => this.inService);
    this.plot.onSelect = () => this.writeCode();
    this.plot.onEdit = () => this.edited();
    this.name.input.value = file;
    const sides = choice("Side", [["accel", "accelerating"], ["decel", "decelerating"]], "accel",
      (value) => {
        this.side = value as Side;
        if (this.side === "decel" && isMirrored(this.editor.table)) this.editor.splitSides();
        this.edited();
      });
    this.sides = sides.select;
    const edit = (run: () => void) => (): void => {
      run();
      this.edited();
    };
    this.undo = button("Undo", edit(() => this.editor.undo()), { testid: "undo" });
    this.redo = button("Redo", edit(() => this.editor.redo()), { testid: "redo" });
    this.mirror = button("", edit(() => {
      if (isMirrored(this.editor.table)) this.editor.splitSides();
      else {
        this.editor.joinSides();
        this.side = this.sides.value = "accel";
      }
    }));
    this.save = button("Save as a revision", () => void this.store(), { testid: "save-table" });
    const group = choice("Group", groups.map((one) => [one, one]), groups[0] ?? "",
      (value) => { this.group = value; this.update(); });
    this.group = groups[0] ?? "";
    this.use = button("Use from the next move on", () => void this.putInService(), { testid: "use-table" });
    this.connectFields();
    this.root.append(
      el("h2", { text: `${file}, revision ${table.revision}` }),
      el("p", { class: "quiet", text:
        [table.description, `time unit ${table.time_unit_ns} ns`].filter((text) => text !== "").join("; ") }),
      el("div", { class: "codes" }, sides.root, this.index.root, this.code.root, this.speed.root,
        button("Insert after", edit(() => this.editor.insertAfter(this.side, this.plot.selected))),
        button("Delete", edit(() => this.editor.remove(this.side, this.plot.selected))),
        this.undo, this.redo, this.mirror),
      this.plot.root, this.times, el("h3", { text: "Check" }), this.messages,
      el("details", {}, this.difference,
        el("table", { class: "plain" }, el("thead", {}, el("tr", {},
          ...["Code", "In service", "Edited", "Speed"].map((text) => el("th", { scope: "col", text })))),
        this.changes)),
      el("div", { class: "fields" }, this.name.root, this.save),
      ...(groups.length > 0 ? [el("div", { class: "fields" }, group.root, this.use)] : []),
      this.said,
    );
    this.root.addEventListener("keydown", (event) => {
      if (!event.ctrlKey || event.altKey || event.target instanceof HTMLInputElement) return;
      const key = event.key.toLowerCase();
      if (key === "z" && !event.shiftKey) this.editor.undo();
      else if (key === "y" || (key === "z" && event.shiftKey)) this.editor.redo();
      else return;
      event.preventDefault();
      this.edited();
    });
  }

  start(): void {
    this.plot.start();
    this.edited();
  }

  update(): void {
    const may = mayCommand(this.app);
    this.save.disabled = !may;
    this.use.disabled = !may;
    void this.compare();
  }

  say(text: string): void {
    put(this.said, text);
  }

  get isChanged(): boolean {
    return this.editor.table !== this.loaded;
  }

  close(): void {
    clearTimeout(this.timer);
    this.plot.close();
  }

  // What is in service changes while the editor is open: by its own button, and by other people.
  private async compare(): Promise<void> {
    const motors = this.app.model.daemons.get(this.daemon)?.motors.values() ?? [];
    const revision = servedRevision(motors, this.loaded.name, this.group);
    if (revision === this.compared) return;
    this.compared = revision;
    const answer = revision === undefined ? undefined : await this.app.requests.ask(
      this.daemon, "get table", { table: `${this.file}@${revision}` }, { quiet: true });
    if (revision !== this.compared) return; // another one has come meanwhile
    this.inService = answer?.detail.table;
    if (answer && !this.inService) setTimeout(() => { this.compared = undefined; }, kAskAgainMs);
    this.plot.show(this.side, this.diagnostics);
    this.writeDifference();
  }

  private connectFields(): void {
    const whole = (input: HTMLInputElement): number | undefined => {
      const value = parseNumber(input.value);
      attribute(input, "aria-invalid", value === undefined ? "true" : undefined);
      return value;
    };
    this.index.input.addEventListener("change", () => {
      const value = whole(this.index.input);
      if (value !== undefined) this.plot.select(Math.round(value));
    });
    const set = (code: number): void => {
      this.editor.setCode(this.side, this.plot.selected, code);
      const now = this.editor.codes(this.side)[this.plot.selected];
      const { low, high } = this.editor.range(this.side, this.plot.selected);
      this.edited();
      put(this.said, now === code ? "" :
        `${this.side}[${this.plot.selected}] is ${now}: its neighbours allow ${low} to ${high}`);
    };
    this.code.input.addEventListener("change", () => {
      const value = whole(this.code.input);
      if (value !== undefined) set(Math.round(value));
    });
    this.speed.input.addEventListener("change", () => {
      const value = whole(this.speed.input);
      if (value !== undefined && value > 0) set(codeOf(value, this.editor.table.time_unit_ns));
    });
  }

  private edited(): void {
    if (this.side === "decel" && isMirrored(this.editor.table)) this.side = this.sides.value = "accel";
    this.plot.show(this.side, this.diagnostics);
    this.writeCode();
    const { table } = this.editor;
    this.undo.disabled = !this.editor.canUndo;
    this.redo.disabled = !this.editor.canRedo;
    put(this.mirror, isMirrored(table) ? "Decelerating codes of its own" : "Mirror the accelerating side");
    const steps = [10, 100, 1000, 10_000];
    put(this.times, `Moves: ${steps.map((n) => `${n} steps in ${duration(moveTimeS(table, n))}`).join(", ")}`);
    this.writeDifference();
    this.update();
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.check(), kCheckAfterMs);
  }

  private writeCode(): void {
    const code = this.editor.codes(this.side)[this.plot.selected];
    this.index.input.value = String(this.plot.selected);
    this.code.input.value = String(code ?? "");
    this.speed.input.value = code === undefined ? "" : short(speedOf(code, this.editor.table.time_unit_ns), 6);
  }

  private writeDifference(): void {
    const { table } = this.editor;
    const base = this.inService ?? this.loaded;
    const of = this.inService ? `revision ${base.revision}, in service` : `revision ${base.revision}`;
    const { codes, extra } = diffOf(base, table);
    const count = codes.length + extra.length;
    put(this.difference, count === 0 ? `As ${of}` : `${count} changes against ${of}`);
    const speed = (code: number | undefined, unit: number): string =>
      code === undefined ? "–" : short(speedOf(code, unit), 5);
    this.changes.replaceChildren(
      ...extra.map((text) => el("tr", {}, el("td", { text, colspan: "4" }))),
      ...codes.slice(0, kShownChanges).map((change) => el("tr", {},
        el("td", { text: `${change.side}[${change.index}]` }),
        el("td", { text: String(change.before ?? "–") }),
        el("td", { text: String(change.after ?? "–") }),
        el("td", { text:
          `${speed(change.before, base.time_unit_ns)} → ${speed(change.after, table.time_unit_ns)} steps/s` }))),
      ...(codes.length > kShownChanges
        ? [el("tr", {}, el("td", { text: `and ${codes.length - kShownChanges} more`, colspan: "4" }))] : []),
    );
  }

  private async check(): Promise<void> {
    const round = ++this.checks;
    const answer = await this.app.requests.call("check", { table: this.editor.table });
    if (round !== this.checks) return;
    this.diagnostics = answer.detail.diagnostics ?? [];
    const items = this.diagnostics.map((found) => el(
      "li", {},
      found.index === null ? null : button(`${found.side}[${found.index}]`, () => this.goTo(found)),
      el("strong", { text: `${found.severity}: ` }), el("span", { text: `${found.rule}: ${found.message}` }),
    ));
    if (answer.phase !== "result") items.push(el("li", { class: "error-text", text: answer.reason }));
    else if (items.length === 0) items.push(el("li", { text: "good" }));
    this.messages.replaceChildren(...items);
    this.plot.show(this.side, this.diagnostics);
  }

  private goTo(found: Diagnostic): void {
    const own = !isMirrored(this.editor.table);
    const index = found.index ?? 0;
    if (found.side === "decel" && own) this.side = this.sides.value = "decel";
    else this.side = this.sides.value = "accel";
    this.plot.show(this.side, this.diagnostics);
    this.plot.select(found.side === "decel" && !own ? this.editor.codes("accel").length - 1 - index : index);
    this.plot.root.focus();
  }

  private async store(): Promise<void> {
    const name = this.name.input.value.trim();
    if (name === "") {
      put(this.said, "Type a name first");
      return;
    }
    const { table } = this.editor;
    const why = tooLong(table);
    if (why !== "") {
      put(this.said, why);
      return;
    }
    const answer = await this.app.requests.ask(this.daemon, "set table", {
      table: name,
      expected_hash: name === this.file ? this.loaded.hash : "",
      content: name === this.file ? table : { ...table, name, revision: 0 },
    });
    this.say(isGood(answer) ? `Saved; ${answer.reason}` : answer.reason);
    // The editor that comes after this one says it too.
    if (isGood(answer)) this.onSaved(`Saved; ${answer.reason}`);
  }

  private async putInService(): Promise<void> {
    const answer = await this.app.requests.ask(
      this.daemon, "use table", { group: this.group, table: this.name.input.value.trim() });
    put(this.said, answer.reason);
    show(this.said, true);
  }
}
