// Elements without a framework. What changes often is written by put() and mark(), which touch the
// document only where something differs.

type Child = Node | string | null | undefined | false;

export interface Props {
  class?: string | undefined;
  testid?: string | undefined;
  text?: string | undefined;
  on?: Record<string, (event: never) => void>;
  [attribute: string]: unknown;
}

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  props: Props = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(props)) {
    if (value === undefined || value === false || value === null) continue;
    if (name === "class") node.className = String(value);
    else if (name === "testid") node.dataset["testid"] = String(value);
    else if (name === "text") node.textContent = String(value);
    else if (name === "on") {
      for (const [event, listener] of Object.entries(value as Record<string, EventListener>)) {
        node.addEventListener(event, listener);
      }
    } else node.setAttribute(name, value === true ? "" : String(value));
  }
  for (const child of children) if (child) node.append(child);
  return node;
}

export function put(node: Node, text: string): void {
  const first = node.firstChild;
  if (first?.nodeType === Node.TEXT_NODE && first.nextSibling === null) {
    if (first.nodeValue !== text) first.nodeValue = text;
  } else if (first !== null || text !== "") {
    node.textContent = text;
  }
}

export function mark(node: Element, name: string, on: boolean): void {
  if (node.classList.contains(name) !== on) node.classList.toggle(name, on);
}

export function attribute(node: Element, name: string, value: string | undefined): void {
  if (value === undefined) {
    if (node.hasAttribute(name)) node.removeAttribute(name);
  } else if (node.getAttribute(name) !== value) {
    node.setAttribute(name, value);
  }
}

export function show(node: HTMLElement, shown: boolean): void {
  if (node.hidden === shown) node.hidden = !shown;
}

export function button(
  text: string,
  run: () => void,
  props: Props = {},
): HTMLButtonElement {
  return el("button", { type: "button", text, on: { click: run }, ...props });
}

let fields = 0;

// An input with its label, which says the unit too.
export function field(
  label: string,
  props: Props = {},
): { root: HTMLElement; input: HTMLInputElement; label: HTMLElement } {
  const id = `field-${++fields}`;
  const input = el("input", { id, autocomplete: "off", ...props });
  const name = el("label", { for: id, text: label });
  return { root: el("div", { class: "field" }, name, input), input, label: name };
}

export function choice(
  label: string,
  options: [value: string, text: string][],
  value: string,
  changed: (value: string) => void,
  props: Props = {},
): { root: HTMLElement; select: HTMLSelectElement } {
  const id = `field-${++fields}`;
  const select = el("select", { id, ...props });
  for (const [of, text] of options) select.append(el("option", { value: of, text }));
  select.value = value;
  select.addEventListener("change", () => changed(select.value));
  return { root: el("div", { class: "field" }, el("label", { for: id, text: label }), select), select };
}

export function section(title: string, ...children: Child[]): HTMLElement {
  return el("section", { class: "panel" }, el("h2", { text: title }), ...children);
}

// A file for whoever looks at the page.
export function download(name: string, text: string, type = "text/csv"): void {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = el("a", { href: url, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
