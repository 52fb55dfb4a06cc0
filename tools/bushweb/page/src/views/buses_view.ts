// Buses and their MCUs: state, errors a second, what was repaired, latency.
import { age, fixed, microseconds, short } from "../logic/format";
import type { LatencyBin } from "../net/messages";
import type { Bus, Changes, Mcu } from "../model/model";
import type { App, View } from "../ui/app";
import { el, put, section } from "../ui/dom";
import { FirstStart } from "../ui/first_start";

const kColumns = [
  "MCU", "State", "Heard", "Errors/s", "Repairs/s", "Errors", "Repairs", "Missed ticks", "Ramp-downs",
  "Timeouts", "Restarts", "Least queue (ticks)", "Crystal (ppm)", "Clock (us)", "Firmware", "Last reset",
];

const kWords = 3; // columns before the numbers

export class BusesView implements View {
  readonly title = "Buses";
  readonly root = el("div", { testid: "buses" });
  private readonly first: FirstStart;
  private readonly body = el("div", {});

  constructor(private readonly app: App) {
    this.first = new FirstStart(app);
    this.root.append(el("h1", { text: "Buses and MCUs" }), this.first.root, this.body);
    this.draw();
  }

  update(changes: Changes): void {
    if (changes.structure) this.first.update();
    if (changes.structure || changes.health) this.draw();
  }

  tick(): void {
    this.first.update();
    for (const cell of this.body.querySelectorAll<HTMLElement>("[data-mcu]")) {
      const mcu = this.mcus.get(cell.dataset["mcu"] ?? "");
      if (mcu) put(cell, this.heard(mcu));
    }
  }

  close(): void {}

  private mcus = new Map<string, Mcu>();

  // Once a second, as health comes: what has the focus or was scrolled is looked after below.
  private draw(): void {
    this.mcus = new Map(this.app.model.allMcus().map((mcu) => [mcu.key, mcu]));
    const focused = document.activeElement instanceof HTMLElement && this.body.contains(document.activeElement)
      ? document.activeElement.dataset["bus"] : undefined;
    const scrolled = new Map(
      [...this.body.querySelectorAll<HTMLElement>("[data-bus]")].map((wide) => [wide.dataset["bus"], wide.scrollLeft]));
    this.body.replaceChildren(...[...this.app.model.daemons.values()].flatMap((daemon) => {
      const names = new Set([...daemon.mcus.values()].map((mcu) => mcu.bus));
      for (const name of daemon.buses.keys()) names.add(name);
      const several = this.app.model.daemons.size > 1 ? `${daemon.name}: ` : "";
      return [...names].map((name) => this.busOf(`${several}bus ${name}`, daemon.buses.get(name),
        [...daemon.mcus.values()].filter((mcu) => mcu.bus === name && mcu.about?.address !== 0)));
    }));
    for (const wide of this.body.querySelectorAll<HTMLElement>("[data-bus]")) {
      wide.scrollLeft = scrolled.get(wide.dataset["bus"]) ?? 0;
      if (focused !== undefined && wide.dataset["bus"] === focused) wide.focus();
    }
  }

  private busOf(title: string, bus: Bus | undefined, mcus: Mcu[]): HTMLElement {
    const health = bus?.health;
    const port = mcus.find((mcu) => mcu.about?.port)?.about?.port;
    const facts: [string, string][] = health ? [
      ["Port", `${port ?? ""} ${health.port_state}`.trim()],
      ["Tick", mcus[0]?.about ? microseconds(mcus[0].about.tick_ns / 1000) : "–"],
      ["Errors at the PC", `${health.crc_errors}, ${perSecond(bus.crc.perSecond())}`],
      ["Stray frames", String(health.stray_frames)],
      ["Line busy", busy(bus.line.perSecond(), health.line_bytes_per_s)],
      ["Recent latency", microseconds(health.recent_latency_us)],
      ["Start margin", health.start_margin_us === 0 ? "–" : microseconds(health.start_margin_us)],
    ] : [["Health", "not reported yet"]];
    return section(
      title,
      health?.two_masters ? el("p", { class: "error-text", text:
        "Another master talks on this bus. Stop the other program: its frames and those of bushd collide." }) : null,
      el("dl", { class: "facts" }, ...facts.map(([name, value]) =>
        el("div", {}, el("dt", { text: name }), el("dd", { text: value })))),
      health ? histogram(health.latency) : null,
      el("div", {
        class: "wide", tabindex: "0", role: "region", "aria-label": `MCUs of ${title}`, "data-bus": title,
      }, el("table", { class: "plain" },
        el("thead", {}, el("tr", {}, ...kColumns.map((text, i) =>
          el("th", { class: i < kWords ? undefined : "number", scope: "col", text })))),
        el("tbody", {}, ...mcus.map((mcu) => this.rowOf(mcu, bus))))),
    );
  }

  private rowOf(mcu: Mcu, bus: Bus | undefined): HTMLElement {
    const health = bus?.health.mcus.find((one) => one.mcu === mcu.name);
    const rates = bus?.mcus.get(mcu.name);
    const state = mcu.state?.state ?? "not reported";
    const bad = ["OFFLINE", "FAULT"].includes(state.toUpperCase());
    const cells: string[] = health ? [
      perSecond(rates?.crc.perSecond()), perSecond(rates?.repeats.perSecond()), String(health.crc_errors),
      String(health.repeats), String(health.missed_ticks), String(health.ramp_downs), String(health.timeouts),
      String(health.restarts), health.low_water_ticks === null || health.low_water_ticks < 0
        ? "–" : String(health.low_water_ticks),
      fixed(health.rate_ppm, 1), fixed(health.clock_offset_us, 1), String(health.firmware_version),
      health.reset_cause || "–",
    ] : kColumns.slice(kWords).map(() => "–");
    return el(
      "tr", { class: bad ? "bad" : undefined, testid: `mcu-${mcu.name}` },
      el("th", { scope: "row", text: mcu.name }),
      el("td", { text: mcu.state?.detail ? `${state}: ${mcu.state.detail}` : state }),
      el("td", { text: this.heard(mcu), "data-mcu": mcu.key }),
      ...cells.map((text) => el("td", { class: "number", text })),
    );
  }

  private heard(mcu: Mcu): string {
    return this.app.model.isOld(mcu) ? `${age(this.app.model.ageMs(mcu))} ago` : "now";
  }
}

function busy(bytesPerSecond: number | undefined, most: number): string {
  return bytesPerSecond === undefined || most === 0 ? "–" : `${short((100 * bytesPerSecond) / most, 3)} %`;
}

function perSecond(rate: number | undefined): string {
  return rate === undefined ? "–" : `${short(rate, 3)} /s`;
}

// Shares of answers by the time that they took.
function histogram(bins: LatencyBin[]): HTMLElement {
  const total = bins.reduce((sum, bin) => sum + bin.answers, 0);
  const most = Math.max(...bins.map((bin) => bin.answers), 1);
  const bars = bins.map((bin) => {
    const bar = el("div", { class: "bar" });
    bar.style.height = `${bin.answers === 0 ? 0 : Math.max(2, (bin.answers / most) * 100)}%`;
    const below = bin.below_us === null ? "longer" : `< ${microseconds(bin.below_us)}`;
    const share = total === 0 ? 0 : (bin.answers / total) * 100;
    return el("li", { title: `${below}: ${bin.answers} answers` },
      el("div", { class: "stand" }, bar),
      el("span", { text: below }), el("span", { class: "quiet", text: `${short(share, 2)} %` }));
  });
  return el("div", { class: "histogram" },
    el("h3", { text: `Latency of ${total} answers` }), el("ol", {}, ...bars));
}
