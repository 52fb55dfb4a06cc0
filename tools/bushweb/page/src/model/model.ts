// What the page knows of all daemons: by daemon and name from the beginning, so that two daemons
// may have motors of one name. What a daemon has said stays when its connection ends, and grows
// old: heardMs of its MCUs tells. Motors and MCUs that a daemon tells of no more leave its lists, and
// are the same objects when they come back, as after a restart: views may hold them.
import type {
  BusHealth, DaemonMessage, DescriptionMessage, HealthMessage, Hello, McuDescription, McuState,
  MotorDescription, MotorState, StateMessage,
} from "../net/messages";
import { Lateness } from "./lateness";
import { Rate } from "./rates";

export interface Motor {
  readonly key: string;
  readonly daemon: string;
  readonly name: string;
  mcu: Mcu;
  state: MotorState | undefined;
  about: MotorDescription | undefined;
  there: boolean; // its daemon tells of it
}

export interface Mcu {
  readonly key: string;
  readonly daemon: string;
  readonly name: string;
  bus: string;
  part: number;
  heardMs: number; // by the page's clock
  state: McuState | undefined;
  about: McuDescription | undefined;
  motors: Motor[];
}

export interface Bus {
  readonly key: string;
  readonly daemon: string;
  readonly name: string;
  health: BusHealth;
  heardMs: number;
  crc: Rate;
  line: Rate; // bytes
  mcus: Map<string, { crc: Rate; repeats: Rate }>;
}

export interface Daemon {
  readonly name: string;
  connected: boolean;
  why: string;
  told: boolean; // whether it is connected
  mcus: Map<string, Mcu>;
  motors: Map<string, Motor>;
  buses: Map<string, Bus>;
}

export interface Changes {
  structure: boolean; // which daemons, MCUs and motors there are, or what is said of them
  motors: Set<Motor>;
  mcus: Set<Mcu>;
  health: boolean;
  rights: boolean;
}

export const kOldMs = 1000;
const kLateMs = 200; // less than that is the scatter of timers and networks

export function noChanges(): Changes {
  return { structure: false, motors: new Set(), mcus: new Set(), health: false, rights: false };
}

export class Model {
  readonly daemons = new Map<string, Daemon>();
  hello: Hello | undefined;
  changes = noChanges();
  // Each report of a motor's MCU, whether the motor has changed or not.
  onReport: (mcu: Mcu) => void = () => {};
  private readonly lateness = new Map<string, Lateness>();
  // All that there have been since the page was opened, by key.
  private readonly everMcus = new Map<string, Mcu>();
  private readonly everMotors = new Map<string, Motor>();

  constructor(private readonly nowMs: () => number) {}

  takeHello(hello: Hello): void {
    this.hello = hello;
    const names = Array.isArray(hello.daemons) ? hello.daemons : [];
    for (const daemon of [...this.daemons.values()]) {
      if (names.includes(daemon.name)) continue;
      this.keepOnly(daemon, []);
      this.daemons.delete(daemon.name);
    }
    for (const name of names) this.daemon(name);
    this.changes.structure = this.changes.rights = true;
  }

  takeDaemon(message: DaemonMessage): void {
    const daemon = this.daemon(message.daemon);
    daemon.connected = message.connected;
    daemon.why = message.why ?? "";
    daemon.told = true;
    this.changes.structure = true;
  }

  takeState(message: StateMessage): void {
    const daemon = this.daemon(message.daemon);
    const nowMs = this.nowMs();
    const lateMs = this.latenessOf(message.daemon).of(message.utime_us / 1000, nowMs);
    const heardMs = lateMs > kLateMs ? nowMs - lateMs : nowMs;
    if (message.full) this.keepOnly(daemon, message.mcus);
    for (const told of message.mcus) {
      const mcu = this.mcu(daemon, told.mcu, told.bus, told.part);
      mcu.heardMs = Math.max(mcu.heardMs, heardMs);
      mcu.state = told;
      for (const state of told.motors) {
        const motor = this.motor(daemon, mcu, state.name);
        motor.state = state;
        this.changes.motors.add(motor);
      }
      if (message.full) this.keepMotors(daemon, mcu, told.motors);
      this.changes.mcus.add(mcu);
      this.onReport(mcu);
    }
  }

  takeDescription(message: DescriptionMessage): void {
    const daemon = this.daemon(message.daemon);
    if (message.full) this.keepOnly(daemon, message.mcus);
    for (const told of message.mcus) {
      const mcu = this.mcu(daemon, told.mcu, told.bus, told.part);
      mcu.about = told;
      for (const about of told.motors) this.motor(daemon, mcu, about.name).about = about;
    }
    this.changes.structure = true;
  }

  takeHealth(message: HealthMessage): void {
    const daemon = this.daemon(message.daemon);
    const nowMs = this.nowMs();
    if (message.full) {
      const names = new Set(message.buses.map((bus) => bus.bus));
      for (const name of [...daemon.buses.keys()]) if (!names.has(name)) daemon.buses.delete(name);
    }
    for (const health of message.buses) {
      let bus = daemon.buses.get(health.bus);
      if (!bus) {
        bus = {
          key: keyOf(daemon.name, health.bus), daemon: daemon.name, name: health.bus, health,
          heardMs: nowMs, crc: new Rate(), line: new Rate(), mcus: new Map(),
        };
        daemon.buses.set(health.bus, bus);
      }
      bus.health = health;
      bus.heardMs = nowMs;
      bus.crc.take(health.crc_errors, nowMs);
      bus.line.take(health.line_bytes, nowMs);
      for (const mcu of health.mcus) {
        const rates = bus.mcus.get(mcu.mcu) ?? { crc: new Rate(), repeats: new Rate() };
        rates.crc.take(mcu.crc_errors, nowMs);
        rates.repeats.take(mcu.repeats, nowMs);
        bus.mcus.set(mcu.mcu, rates);
      }
    }
    this.changes.health = true;
  }

  // What has changed since it was asked the last time.
  takeChanges(): Changes {
    const changes = this.changes;
    this.changes = noChanges();
    return changes;
  }

  hasChanged(): boolean {
    const { structure, motors, mcus, health, rights } = this.changes;
    return structure || health || rights || motors.size > 0 || mcus.size > 0;
  }

  allMotors(): Motor[] {
    const all: Motor[] = [];
    for (const daemon of this.daemons.values()) {
      const mcus = [...daemon.mcus.values()].sort((a, b) => a.part - b.part);
      for (const mcu of mcus) all.push(...mcu.motors);
    }
    return all;
  }

  allMcus(): Mcu[] {
    return [...this.daemons.values()].flatMap((daemon) =>
      [...daemon.mcus.values()].sort((a, b) => a.part - b.part),
    );
  }

  find(daemon: string, name: string): Motor | undefined {
    return this.daemons.get(daemon)?.motors.get(name);
  }

  // Since its MCU was heard.
  ageMs(mcu: Mcu): number {
    return this.nowMs() - mcu.heardMs;
  }

  isOld(mcu: Mcu): boolean {
    return this.ageMs(mcu) > kOldMs;
  }

  // What is shown of it is not what it does now.
  isOldMotor(motor: Motor): boolean {
    return !motor.there || this.isOld(motor.mcu);
  }

  // A connected daemon with MCUs, of which none has been heard lately. Pseudo-axes are no MCUs.
  isDeaf(name: string): boolean {
    const daemon = this.daemons.get(name);
    const mcus = [...(daemon?.mcus.values() ?? [])].filter((mcu) => mcu.about?.address !== 0);
    return daemon?.connected === true && mcus.length > 0 && mcus.every((mcu) => this.isOld(mcu));
  }

  statesAreDue(): boolean {
    return [...this.daemons.values()].some((daemon) => daemon.connected && daemon.mcus.size > 0);
  }

  private daemon(name: string): Daemon {
    let daemon = this.daemons.get(name);
    if (!daemon) {
      daemon = {
        name, connected: false, why: "", told: false, mcus: new Map(), motors: new Map(),
        buses: new Map(),
      };
      this.daemons.set(name, daemon);
      this.changes.structure = true;
    }
    return daemon;
  }

  private mcu(daemon: Daemon, name: string, bus: string, part: number): Mcu {
    let mcu = daemon.mcus.get(name);
    if (!mcu) {
      const key = keyOf(daemon.name, name);
      mcu = this.everMcus.get(key) ?? {
        key, daemon: daemon.name, name, bus, part,
        heardMs: -Infinity, state: undefined, about: undefined, motors: [],
      };
      this.everMcus.set(key, mcu);
      daemon.mcus.set(name, mcu);
      this.changes.structure = true;
    }
    mcu.bus = bus;
    mcu.part = part;
    return mcu;
  }

  private motor(daemon: Daemon, mcu: Mcu, name: string): Motor {
    let motor = daemon.motors.get(name);
    if (!motor) {
      const key = keyOf(daemon.name, name);
      motor = this.everMotors.get(key) ?? {
        key, daemon: daemon.name, name, mcu, state: undefined, about: undefined, there: true,
      };
      this.everMotors.set(key, motor);
      motor.mcu = mcu;
      motor.there = true;
      // Its state is told anew. A description may have been told before the state without it, and is
      // not told twice.
      motor.state = undefined;
      daemon.motors.set(name, motor);
      mcu.motors.push(motor);
      this.changes.structure = true;
    } else if (motor.mcu !== mcu) {
      motor.mcu.motors = motor.mcu.motors.filter((other) => other !== motor);
      motor.mcu = mcu;
      mcu.motors.push(motor);
      this.changes.structure = true;
    }
    return motor;
  }

  private keepOnly(daemon: Daemon, mcus: readonly { mcu: string }[]): void {
    const names = new Set(mcus.map((mcu) => mcu.mcu));
    for (const mcu of [...daemon.mcus.values()]) {
      if (names.has(mcu.name)) continue;
      this.keepMotors(daemon, mcu, []);
      daemon.mcus.delete(mcu.name);
      this.changes.structure = true;
    }
  }

  private keepMotors(daemon: Daemon, mcu: Mcu, motors: readonly { name: string }[]): void {
    const names = new Set(motors.map((motor) => motor.name));
    const gone = mcu.motors.filter((motor) => !names.has(motor.name));
    if (gone.length === 0) return;
    for (const motor of gone) {
      motor.there = false;
      daemon.motors.delete(motor.name);
    }
    mcu.motors = mcu.motors.filter((motor) => names.has(motor.name));
    this.changes.structure = true;
  }

  private latenessOf(daemon: string): Lateness {
    const lateness = this.lateness.get(daemon) ?? new Lateness();
    this.lateness.set(daemon, lateness);
    return lateness;
  }
}

export function keyOf(daemon: string, name: string): string {
  return JSON.stringify([daemon, name]);
}
