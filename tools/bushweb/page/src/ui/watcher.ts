// Changes of state that belong into the log: daemons, MCUs, trust, holds.
import type { Model } from "../model/model";
import type { EventLog } from "./event_log";

export class Watcher {
  private readonly known = new Map<string, string>();

  constructor(private readonly model: Model, private readonly log: EventLog) {}

  look(): void {
    const { daemons, changes } = this.model;
    if (changes.structure) {
      for (const daemon of daemons.values()) {
        if (!daemon.told) continue;
        this.see(`daemon ${daemon.name}`, daemon.connected ? "connected" : `not connected: ${daemon.why}`,
          daemon.connected ? "ok" : "error", daemon.name);
      }
    }
    for (const mcu of changes.mcus) {
      const word = mcu.state?.state.toUpperCase() ?? "";
      // BUSY, READY and RUN are all well.
      const state = word === "OFFLINE" || word === "FAULT" ? word.toLowerCase() : "online";
      const detail = mcu.state?.detail ? `: ${mcu.state.detail}` : "";
      this.see(`mcu ${mcu.key}`, state + detail, state === "online" ? "ok" : "error", `MCU ${mcu.name}`);
    }
    for (const motor of changes.motors) {
      const state = motor.state;
      if (!state) continue;
      const why = state.uncertain_reason === "" ? "" : `: ${state.uncertain_reason}`;
      this.see(`trust ${motor.key}`, `position ${state.trust}${why}`,
        state.trust === "known" || state.trust === "restored" ? "ok" : "warning", motor.name);
      this.see(`held ${motor.key}`, state.held ? "held" : "not held", "ok", motor.name);
      this.see(`inhibited ${motor.key}`,
        state.inhibited === "" ? "no direction inhibited" : `inhibited: ${state.inhibited}`,
        state.inhibited === "" ? "ok" : "warning", motor.name);
    }
  }

  // What is seen first is no change.
  private see(key: string, state: string, level: "ok" | "warning" | "error", name: string): void {
    const before = this.known.get(key);
    this.known.set(key, state);
    if (before !== undefined && before !== state) this.log.add(level, `${name}: ${state}`);
  }
}
