// Name, views, state of the connection, who may command, and the emergency stop.
import type { App } from "./app";
import { el, put, attribute, show, button } from "./dom";
import { age } from "../logic/format";

const kLinks: [address: string, text: string][] = [
  ["#/", "Motors"], ["#/buses", "Buses"], ["#/tables", "Tables"], ["#/paths", "Paths"],
  ["#/health", "Health"],
];

export class Header {
  private readonly link = el("span", {
    class: "link", testid: "connection", role: "status", "aria-live": "polite",
  });
  private readonly rights = el("a", { class: "rights", testid: "rights", href: "#/access" });
  private readonly links = kLinks.map(([href, text]) => el("a", { href, text }));
  readonly root: HTMLElement;

  constructor(private readonly app: App, emergency: HTMLElement) {
    const nav = el("nav", { "aria-label": "Views" }, ...this.links);
    const skip = button("Skip to content", () => app.scroller.focus(), { class: "skip" });
    this.root = el(
      "header", { class: "top" }, skip,
      el("span", { class: "brand", text: "bushd" }), nav,
      el("div", { class: "status" }, this.link, this.rights), emergency,
    );
    this.update();
  }

  update(): void {
    const { connection, model } = this.app;
    const retries = connection.state === "connecting" && connection.hasFailed();
    const away = [...model.daemons.values()].some((daemon) => daemon.told && !daemon.connected);
    attribute(this.link, "data-daemons", away ? "away" : undefined);
    attribute(this.link, "data-state", retries ? "closed" : connection.state);
    put(this.link, this.words());
    const hello = model.hello;
    show(this.rights, hello !== undefined);
    if (hello) {
      const who = hello.user ?? "";
      put(this.rights, hello.may_command ? (who === "" ? "may command" : who) : "read only");
      attribute(this.rights, "data-may", hello.may_command ? "yes" : "no");
    }
    const here = location.hash || "#/";
    for (const link of this.links) {
      const address = link.getAttribute("href") ?? "";
      const current = address === "#/" ? here === "#/" || here.startsWith("#/motor/") : here.startsWith(address);
      attribute(link, "aria-current", current ? "page" : undefined);
    }
  }

  private words(): string {
    const { connection, model } = this.app;
    const nowMs = this.app.nowMs();
    switch (connection.state) {
      case "connecting":
        // Said once, and not at each attempt.
        return connection.hasFailed() ? "not connected" : "connecting";
      case "closed":
        return "not connected";
      case "silent":
        return `silent for ${age(nowMs - connection.lastHeardMs)}`;
      default: {
        const away = [...model.daemons.values()].filter((daemon) => daemon.told && !daemon.connected);
        if (away.length > 0) return `no daemon: ${away.map((daemon) => daemon.name).join(", ")}`;
        return "connected";
      }
    }
  }
}
