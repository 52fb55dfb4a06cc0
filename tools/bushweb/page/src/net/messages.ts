// What bushd-web and the page say to each other (docs/web.md). Types of the daemon are those of
// lib/lcm/types: the same names of fields, the same units. null: no value.

export type Trust = "unknown" | "known" | "restored" | "stale" | "uncertain";

export interface MotorState {
  name: string;
  position_steps: number | null;
  user_position: number | null;
  dial_position: number | null;
  target_steps: number | null;
  user_target: number | null;
  velocity_steps_per_s: number;
  moving: boolean;
  activity: string;
  enabled: boolean;
  input: boolean;
  inputs: string;
  inhibited: string;
  trust: Trust;
  uncertain_reason: string;
  heard_utime_us: number | null;
  paused: boolean;
  held: boolean;
  armed_by: string;
  on_line: boolean;
  line_fraction: number | null;
  line_left_s: number | null;
}

export interface McuState {
  part: number;
  bus: string;
  mcu: string;
  state: string;
  detail: string;
  inputs: string;
  program: string;
  boot_number: number;
  tick: number;
  motors: MotorState[];
}

export interface TableRef {
  name: string;
  revision: number;
  hash: string;
}

export interface MotorDescription {
  name: string;
  output: number;
  group: string;
  table: TableRef;
  description: string;
  unit: string;
  steps_per_unit: string;
  negative: boolean;
  offset: number;
  precision: number;
  soft_limits: boolean;
  dial_low: number | null;
  dial_high: number | null;
  user_low: number | null;
  user_high: number | null;
}

export interface McuDescription {
  part: number;
  bus: string;
  mcu: string;
  address: number;
  tick_ns: number;
  emergency_stop: string;
  port: string;
  motors: MotorDescription[];
}

export interface LatencyBin {
  below_us: number | null;
  answers: number;
}

export interface McuHealth {
  mcu: string;
  address: number;
  unique_id: string;
  firmware_version: number;
  boot_number: number;
  reset_cause: string;
  current: number;
  crc_errors: number;
  rejected_frames: number;
  ramp_downs: number;
  timeouts: number;
  repeats: number;
  missed_ticks: number;
  restarts: number;
  low_water_ticks: number | null;
  rate_ppm: number;
  clock_offset_us: number;
  two_masters: boolean;
}

export interface BusHealth {
  part: number;
  bus: string;
  port_state: string;
  two_masters: boolean;
  crc_errors: number;
  stray_frames: number;
  recent_latency_us: number;
  start_margin_us: number;
  line_bytes: number;
  line_bytes_per_s: number;
  latency: LatencyBin[];
  mcus: McuHealth[];
}

export interface Hello {
  kind: "hello";
  version: string;
  user: string | null;
  may_command: boolean;
  may_stop: boolean;
  daemons: string[];
}

export interface DaemonMessage {
  kind: "daemon";
  daemon: string;
  connected: boolean;
  why: string;
}

export interface StateMessage {
  kind: "state";
  daemon: string;
  utime_us: number;
  full?: boolean;
  mcus: McuState[];
}

export interface DescriptionMessage {
  kind: "description";
  daemon: string;
  full?: boolean;
  mcus: McuDescription[];
}

export interface HealthMessage {
  kind: "health";
  daemon: string;
  full?: boolean;
  buses: BusHealth[];
}

// Ten times a second. `at` grows; what was heard last goes with each request, so that bushd-web knows
// how old the page's view of the motors was.
export interface Alive {
  kind: "alive";
  at?: number;
}

export interface MotorResult {
  motor: string;
  outcome: string;
  user_position: number;
  unit: string;
  precision: number;
  asked_by: string;
}

export interface MovePlan {
  duration_us: number;
  ticks: number;
  frames: number | null;
  bytes: number | null;
  limited_by: string | null;
  motors: { motor: string; steps: number; duration_us: number; peak_steps_per_s: number }[];
  points_us: number[];
}

export interface TableEntry {
  name: string;
  table: TableRef | null;
  fault: string;
  codes: number | null;
  start_steps_per_s: number | null;
  max_steps_per_s: number | null;
}

export interface TableFile {
  name: string;
  description: string;
  revision: number;
  hash: string;
  time_unit_ns: number;
  cruise: number | null; // none: the last of accel
  accel: number[];
  decel: number[]; // none: accel reversed
}

export interface PastMotion {
  utime_us: number;
  what: string;
  who: string;
  from_steps: number;
  to_steps: number;
  outcome: string;
  reason: string;
  from_text: string;
  to_text: string;
}

export interface Setting {
  motor: string;
  key: string;
  value: string;
  value_in_file: string;
}

export interface Diagnostic {
  severity: "error" | "warning";
  rule: string;
  side: "accel" | "decel" | "cruise" | "";
  index: number | null;
  value: string | number | null;
  limit: string | number | null;
  message: string;
}

export interface Finding {
  level: "ok" | "warning" | "error";
  check: string;
  seen: string;
  remedy: string | null;
}

export interface Detail {
  motors?: MotorResult[];
  plan?: MovePlan;
  tables?: TableEntry[];
  table?: TableFile;
  history?: { motions: PastMotion[] };
  configuration?: { path: string; sha256: string; settings: Setting[] };
  diagnostics?: Diagnostic[];
  findings?: Finding[];
}

export interface Reply {
  kind: "reply";
  id: number;
  phase: "accepted" | "refused" | "result";
  outcome?: string;
  reason: string;
  detail?: Detail | null;
}

export type FromServer =
  | Hello
  | Alive
  | DaemonMessage
  | StateMessage
  | DescriptionMessage
  | HealthMessage
  | Reply;

const kKinds = new Set(["hello", "alive", "daemon", "state", "description", "health", "reply"]);

// A text as a message; nothing if it is none. A newer bushd-web may send kinds that this page does
// not know.
export function parseMessage(text: string): FromServer | undefined {
  try {
    const message: unknown = JSON.parse(text);
    if (typeof message !== "object" || message === null) return undefined;
    const kind = (message as { kind?: unknown }).kind;
    return typeof kind === "string" && kKinds.has(kind) ? (message as FromServer) : undefined;
  } catch {
    return undefined;
  }
}
