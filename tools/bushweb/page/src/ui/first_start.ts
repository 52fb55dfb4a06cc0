// What to do where there is nothing to show yet.
import type { App } from "./app";
import { el, show } from "./dom";

export class FirstStart {
  readonly root = el("section", { class: "first panel", testid: "first-start", hidden: true });
  private shown = "";

  constructor(private readonly app: App) {
    this.update();
  }

  update(): void {
    const parts = this.parts();
    const state = JSON.stringify(parts);
    if (state === this.shown) return;
    this.shown = state;
    this.root.replaceChildren();
    for (const part of parts) {
      this.root.append(
        el("h2", { text: part.title }), el("p", { text: part.seen }),
        ...part.doIt.map((text) => el("p", {}, ...withCode(text))),
      );
    }
    show(this.root, parts.length > 0);
  }

  private parts(): { title: string; seen: string; doIt: string[] }[] {
    const { connection, model } = this.app;
    if (!model.hello) {
      if (!connection.hasFailed()) return [];
      return [{
        title: "No connection to bushd-web",
        seen: "The page tries again each two seconds.",
        doIt: ["On the PC with the motors, `systemctl status bushd-web` says why it does not run."],
      }];
    }
    const parts = [];
    if (model.daemons.size === 0) {
      parts.push({
        title: "bushd-web serves no daemon", seen: "",
        doIt: ["Start it with `bushd-web --daemon NAME=SOCKET`."],
      });
    }
    for (const daemon of model.daemons.values()) {
      if (!daemon.told) continue;
      if (!daemon.connected) {
        parts.push({
          title: `${daemon.name} is not connected`, seen: daemon.why,
          doIt: [
            "A new installation: `sudo bushctl setup` looks for ports and MCUs, and writes the configuration.",
            "`bushctl doctor` says what is wrong with ports, network and rights.",
          ],
        });
      } else if (daemon.mcus.size > 0 && daemon.motors.size === 0) {
        parts.push({
          title: `${daemon.name} has no motors`, seen: "Its configuration names none.",
          doIt: ["`sudo bushctl setup` looks for MCUs at the ports, and writes the configuration."],
        });
      }
    }
    return parts;
  }
}

// `text` between backquotes as code.
export function withCode(text: string): (Node | string)[] {
  return text.split("`").map((part, i) => (i % 2 === 1 ? el("code", { text: part }) : part));
}
