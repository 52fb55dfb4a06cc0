// Which view an address stands for.
import type { App, View } from "../ui/app";
import { el } from "../ui/dom";
import { FirstStart } from "../ui/first_start";
import { AccessView } from "./access_view";
import { BusesView } from "./buses_view";
import { HealthView } from "./health_view";
import { MotorView } from "./motor_view";
import { Overview } from "./overview";
import { PathsView } from "./paths_view";
import { TablesView } from "./tables_view";

export function viewOf(app: App, address: string): View {
  const [name, ...rest] = address.replace(/^#\/?/, "").split("/").map(decoded);
  switch (name) {
    case "motor": {
      const motor = app.model.find(rest[0] ?? "", rest[1] ?? "");
      return motor?.about ? new MotorView(app, motor) : missing(app, rest[1] ?? "");
    }
    case "buses":
      return new BusesView(app);
    case "tables":
      return new TablesView(app);
    case "paths":
      return new PathsView(app);
    case "health":
      return new HealthView(app);
    case "access":
      return new AccessView(app);
    default:
      return new Overview(app);
  }
}

function decoded(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

// A motor that is not there, or not yet: a view without a title is made again with the next change.
function missing(app: App, name: string): View {
  const first = new FirstStart(app);
  const known = app.model.daemons.size > 0 && app.model.allMotors().length > 0;
  const text = known ? `No motor is called "${name}".` : `Waiting for what the daemon says of "${name}".`;
  return {
    title: "",
    root: el("div", {}, el("h1", { text: name }), el("p", { text }),
      el("p", {}, el("a", { href: "#/", text: "All motors" })), first.root),
    update: () => first.update(),
    tick: () => first.update(),
    close: () => {},
  };
}
