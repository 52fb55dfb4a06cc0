// Rings of the motors that somebody has looked at since the page was opened.
import type { Mcu, Model, Motor } from "../model/model";
import { Ring } from "../model/ring";

const kMostMotors = 64; // each takes 256 KB
export const nowS = (): number => (performance.timeOrigin + performance.now()) / 1000;

export class Recorder {
  private readonly rings = new Map<string, Ring>();

  constructor(private readonly model: Model) {}

  of(motor: Motor): Ring {
    let ring = this.rings.get(motor.key);
    if (!ring) {
      ring = new Ring();
      // The one that was looked at longest ago goes.
      const oldest = this.rings.keys().next();
      if (this.rings.size >= kMostMotors && !oldest.done) this.rings.delete(oldest.value);
    } else {
      this.rings.delete(motor.key);
    }
    this.rings.set(motor.key, ring);
    return ring;
  }

  take(mcu: Mcu): void {
    if (this.rings.size === 0) return;
    // When it was heard, not now: late messages stand where they belong.
    const atS = nowS() - this.model.ageMs(mcu) / 1000;
    for (const motor of mcu.motors) {
      const ring = this.rings.get(motor.key);
      const state = motor.state;
      if (!ring || !state) continue;
      const unknown = state.trust === "unknown" || state.trust === "stale";
      ring.push({
        atS,
        position: unknown ? NaN : (state.user_position ?? NaN),
        target: unknown ? NaN : (state.user_target ?? NaN),
        speed: unknown ? NaN : userSpeed(motor),
      });
    }
  }
}

// Speed in the motor's unit per second, on the user's scale.
export function userSpeed(motor: Motor): number {
  const steps = motor.state?.velocity_steps_per_s ?? NaN;
  return (steps / stepsPerUnit(motor)) * (motor.about?.negative ? -1 : 1);
}

// "320" or "1/3".
export function stepsPerUnit(motor: Motor): number {
  const [over = "1", under = "1"] = (motor.about?.steps_per_unit ?? "1").split("/");
  const value = Number(over) / Number(under);
  return Number.isFinite(value) && value !== 0 ? value : 1;
}
