// A list of which only what is in view is in the document: 512 motors are a dozen rows.
import { attribute, el } from "./dom";

export interface Row {
  readonly root: HTMLElement;
}

export interface Item<T> {
  key: string;
  height: number;
  value: T;
}

const kMarginPx = 200; // drawn beyond the view, so that scrolling shows no holes

export class VirtualList<T, R extends Row> {
  readonly root: HTMLElement;
  private items: Item<T>[] = [];
  private tops: number[] = [];
  private readonly rows = new Map<string, R>();
  private frame = 0;
  private readonly changed = (): void => this.schedule();
  private readonly resizes = new ResizeObserver(this.changed);

  constructor(
    private readonly scroller: HTMLElement,
    private readonly make: (value: T) => R,
    role = "rowgroup",
  ) {
    this.root = el("div", { class: "virtual", role });
    scroller.addEventListener("scroll", this.changed, { passive: true });
    this.resizes.observe(scroller);
  }

  set(items: Item<T>[]): void {
    this.items = items;
    this.tops = [];
    let top = 0;
    for (const item of items) {
      this.tops.push(top);
      top += item.height;
    }
    this.root.style.height = `${top}px`;
    this.draw();
  }

  // Those in view.
  shown(): IterableIterator<[string, R]> {
    return this.rows.entries();
  }

  row(key: string): R | undefined {
    return this.rows.get(key);
  }

  close(): void {
    this.scroller.removeEventListener("scroll", this.changed);
    this.resizes.disconnect();
    cancelAnimationFrame(this.frame);
  }

  draw(): void {
    const offset =
      this.root.getBoundingClientRect().top - this.scroller.getBoundingClientRect().top;
    const from = -offset - kMarginPx;
    const to = -offset + this.scroller.clientHeight + kMarginPx;
    const first = this.firstBelow(from);
    const wanted = new Map<string, number>();
    for (let i = first; i < this.items.length && (this.tops[i] ?? 0) < to; ++i) {
      const item = this.items[i];
      if (item) wanted.set(item.key, i);
    }
    for (const [key, row] of this.rows) {
      // A row that has the focus stays until that goes elsewhere, so that keys are not lost.
      if (wanted.has(key) || row.root.contains(document.activeElement)) continue;
      row.root.remove();
      this.rows.delete(key);
    }
    for (const key of this.rows.keys()) {
      if (wanted.has(key)) continue;
      const i = this.items.findIndex((item) => item.key === key);
      if (i >= 0) wanted.set(key, i);
      else {
        this.rows.get(key)?.root.remove();
        this.rows.delete(key);
      }
    }
    // In the order of the list, for those who go through it by Tab.
    let before: Element | null = null;
    for (const [key, i] of [...wanted].sort((a, b) => a[1] - b[1])) {
      const item = this.items[i];
      if (!item) continue;
      let row = this.rows.get(key);
      if (!row) {
        row = this.make(item.value);
        this.rows.set(key, row);
      }
      const place: ChildNode | null = before ? before.nextSibling : this.root.firstChild;
      if (row.root !== place) this.root.insertBefore(row.root, place);
      before = row.root;
      const top = `translateY(${this.tops[i] ?? 0}px)`;
      if (row.root.style.transform !== top) row.root.style.transform = top;
      attribute(row.root, "aria-rowindex", String(i + 2));
    }
  }

  private schedule(): void {
    cancelAnimationFrame(this.frame);
    this.frame = requestAnimationFrame(() => this.draw());
  }

  private firstBelow(y: number): number {
    let low = 0;
    let high = this.items.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      const bottom = (this.tops[middle] ?? 0) + (this.items[middle]?.height ?? 0);
      if (bottom < y) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}
