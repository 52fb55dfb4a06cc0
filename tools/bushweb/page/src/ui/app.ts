// What all views use.
import { age } from "../logic/format";
import type { PathSender } from "../logic/path_sender";
import type { Answer, Options, Requests } from "../net/requests";
import type { Connection } from "../net/connection";
import type { Changes, Model, Motor } from "../model/model";
import type { EventLog } from "./event_log";
import type { Recorder } from "./recorder";

export interface View {
  readonly root: HTMLElement;
  readonly title: string;
  update(changes: Changes): void;
  tick(): void; // four times a second: ages
  pauseMs?(): number; // least time from the last update to the next one
  close(): void;
}

export interface App {
  readonly model: Model;
  readonly connection: Connection;
  readonly requests: Requests;
  readonly paths: PathSender; // outlives the view: so does a path that runs
  readonly log: EventLog;
  readonly recorder: Recorder;
  readonly scroller: HTMLElement; // what the views stand in
  nowMs(): number;
  notice(level: "ok" | "warning" | "error", text: string): void;
}

export function mayCommand(app: App): boolean {
  return mayEnd(app) && !app.connection.isSilent();
}

// For what ends motions and needs the right to command: also while bushd-web is silent.
export function mayEnd(app: App): boolean {
  return app.model.hello?.may_command === true && app.connection.isOpen();
}

// Also without a connection: a stop is always tried.
export function mayStop(app: App): boolean {
  return app.model.hello?.may_command === true || app.model.hello?.may_stop === true;
}

// How old what is shown of a motor is; nothing where it is of now.
export function ageOf(app: App, motor: Motor): string {
  if (!app.model.isOldMotor(motor)) return "";
  const ageMs = app.model.ageMs(motor.mcu);
  if (!Number.isFinite(ageMs)) return "never heard";
  return app.model.isOld(motor.mcu) ? `${age(ageMs)} old` : "old: its daemon tells of it no more";
}

// Asks for something of one motor.
export function askMotor(
  app: App,
  motor: Motor,
  request: string,
  fields: object = { motors: [motor.name] },
  options: Options = {},
): Promise<Answer> {
  return app.requests.ask(motor.daemon, request, fields, options);
}

export function motorAddress(motor: Motor): string {
  return `#/motor/${encodeURIComponent(motor.daemon)}/${encodeURIComponent(motor.name)}`;
}

export function unitOf(motor: Motor): string {
  return motor.about?.unit ?? "";
}

export function precisionOf(motor: Motor): number {
  return motor.about?.precision ?? 0;
}
