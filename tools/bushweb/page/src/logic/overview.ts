// Which motors the overview shows, and in which order.
import type { Motor } from "../model/model";

export type Grouping = "group" | "mcu" | "none";
export type Sorting = "config" | "name" | "state";

export interface Layout {
  grouping: Grouping;
  sorting: Sorting;
  filter: string;
  onlyFavourites: boolean;
  favourites: string[]; // keys of motors
}

export interface Section {
  title: string;
  motors: Motor[];
}

// "slit*", "m0[1-4]", "@stage": as in requests. Otherwise a part of name, description or group.
export function matcher(filter: string): (motor: Motor) => boolean {
  const words = filter.toLowerCase().split(/\s+/).filter((word) => word !== "");
  const tests = words.map((word) => {
    const ofGroup = word.startsWith("@");
    const plain = ofGroup ? word.slice(1) : word;
    const pattern = /[*?[]/.test(plain) ? globOf(plain) : undefined;
    return (motor: Motor): boolean => {
      const group = (motor.about?.group ?? "").toLowerCase();
      if (ofGroup) return pattern ? pattern.test(group) : group.startsWith(plain);
      const name = motor.name.toLowerCase();
      if (pattern) return pattern.test(name);
      return (
        name.includes(plain) ||
        group.includes(plain) ||
        motor.mcu.name.toLowerCase().includes(plain) ||
        (motor.about?.description ?? "").toLowerCase().includes(plain)
      );
    };
  });
  return (motor) => tests.every((test) => test(motor));
}

function globOf(pattern: string): RegExp {
  const source = pattern.replace(/[.+^${}()|\\]/g, "\\$&").replace(/\*/g, ".*").replace(/\?/g, ".");
  try {
    return new RegExp(`^${source}$`);
  } catch {
    return /^$/; // a bracket that is not closed yet matches nothing
  }
}

// What wants to be looked at comes first: 0 is the most urgent.
export function urgency(motor: Motor): number {
  const state = motor.state;
  if (!state) return 3;
  if (motor.mcu.state?.state === "FAULT" || state.trust === "uncertain") return 0;
  if (state.moving || state.activity !== "rest") return 1;
  if (state.trust !== "known" || state.held || state.paused || state.inhibited !== "") return 2;
  return 4;
}

export function sections(motors: Motor[], layout: Layout, severalDaemons: boolean): Section[] {
  const favourites = new Set(layout.favourites);
  const fits = matcher(layout.filter);
  const shown = motors.filter(
    (motor) => fits(motor) && (!layout.onlyFavourites || favourites.has(motor.key)),
  );
  const titleOf = (motor: Motor): string => {
    const of = severalDaemons ? `${motor.daemon}: ` : "";
    if (layout.grouping === "mcu") return `${of}MCU ${motor.mcu.name}`;
    if (layout.grouping === "group") {
      return of + (motor.about?.group ? `group ${motor.about.group}` : `MCU ${motor.mcu.name}`);
    }
    return "";
  };
  const found = new Map<string, Section>();
  for (const motor of shown) {
    const title = titleOf(motor);
    const section = found.get(title) ?? { title, motors: [] };
    section.motors.push(motor);
    found.set(title, section);
  }
  const compareNames = new Intl.Collator("en", { numeric: true }).compare;
  for (const section of found.values()) {
    if (layout.sorting === "name") section.motors.sort((a, b) => compareNames(a.name, b.name));
    // Sorting is stable, so motors that are equal in this stay as the configuration has them.
    if (layout.sorting === "state") section.motors.sort((a, b) => urgency(a) - urgency(b));
  }
  return [...found.values()];
}

export interface RulerMarks {
  low: number;
  high: number;
  at: number | undefined; // shares of the ruler, 0..1, clamped
  target: number | undefined;
  beyond: boolean; // it stands beyond its limits
}

// Where a motor stands between its soft limits, and where it goes. Nothing without limits.
export function rulerOf(motor: Motor): RulerMarks | undefined {
  const about = motor.about;
  if (!about?.soft_limits || about.user_low === null || about.user_high === null) return undefined;
  const low = about.user_low;
  const high = about.user_high;
  const share = (value: number | null | undefined): number | undefined => {
    if (value === null || value === undefined) return undefined;
    if (high <= low) return 0.5;
    return Math.min(Math.max((value - low) / (high - low), 0), 1);
  };
  const at = motor.state?.user_position ?? null;
  return {
    low, high,
    at: share(at),
    target: motor.state?.moving || motor.state?.paused ? share(motor.state.user_target) : undefined,
    beyond: at !== null && (at < low || at > high),
  };
}

// The state of a motor in words, the most important first.
export function stateWords(motor: Motor): string[] {
  const state = motor.state;
  if (!state) return [];
  const words: string[] = [];
  if (state.activity === "home") words.push("homing");
  else if (state.activity === "local") words.push("moved locally");
  else if (state.activity === "arming") words.push("arming");
  else if (state.activity === "armed") words.push("armed");
  else if (state.moving) words.push("moving");
  if (state.paused) words.push("paused");
  if (state.held) words.push("held");
  if (state.on_line) {
    words.push(`line ${Math.round((state.line_fraction ?? 0) * 100)} %`);
  }
  if (!state.enabled) words.push("drivers off");
  return words;
}
