// Start of the page: one connection, one model, one view at a time.
import "uplot/dist/uPlot.min.css";
import "./page.css";
import { short } from "./logic/format";
import { PathSender } from "./logic/path_sender";
import { browserSocket, browserTimers, Connection } from "./net/connection";
import type { FromServer } from "./net/messages";
import { isGood, Requests, type Answer, type Options } from "./net/requests";
import { Model, noChanges } from "./model/model";
import type { App, View } from "./ui/app";
import { el, put } from "./ui/dom";
import { EventLog } from "./ui/event_log";
import { Header } from "./ui/header";
import { Notices } from "./ui/notices";
import { Recorder } from "./ui/recorder";
import { StopBar } from "./ui/stop_bar";
import { Watcher } from "./ui/watcher";
import { viewOf } from "./views/router";

const kTickMs = 250;

const nowMs = (): number => performance.now();
const model = new Model(nowMs);
const connection = new Connection(browserSocket, browserTimers);
const requests = new Requests(connection, nowMs);
const log = new EventLog();
const notices = new Notices();
const recorder = new Recorder(model);
const scroller = el("main", { id: "main", tabindex: "-1" });
const app: App = {
  paths: new PathSender(),
  model, connection, requests, log, recorder, scroller, nowMs,
  notice: (level, text) => notices.add(level, text),
};
const stopBar = new StopBar(app);
const header = new Header(app, stopBar.emergency);
const watcher = new Watcher(model, log);
let view: View | undefined;
let viewAddress = "";
let frame = 0;
let waits = false; // for a view that wants some time between its updates
let drawnMs = 0;

model.onReport = (mcu) => recorder.take(mcu);

// One frame for all that has come since the last one.
function schedule(): void {
  if (frame !== 0 || waits || !model.hasChanged()) return;
  const pauseMs = drawnMs + (view?.pauseMs?.() ?? 0) - nowMs();
  if (pauseMs <= 0) {
    frame = requestAnimationFrame(draw);
    return;
  }
  waits = true;
  setTimeout(() => {
    waits = false;
    frame = requestAnimationFrame(draw);
  }, pauseMs);
}

function draw(): void {
  frame = 0;
  drawnMs = nowMs();
  const changes = model.takeChanges();
  if (changes.structure || changes.rights) {
    header.update();
    stopBar.update();
    // A motor that was not there when its address was opened may be now, and another in its place.
    if (viewAddress === "" || view?.title === "") navigate();
  }
  view?.update(changes);
}

function take(message: FromServer): void {
  switch (message.kind) {
    case "hello":
      model.takeHello(message);
      break;
    case "daemon":
      model.takeDaemon(message);
      break;
    case "state":
      model.takeState(message);
      break;
    case "description":
      model.takeDescription(message);
      break;
    case "health":
      model.takeHealth(message);
      break;
    case "reply":
      requests.take(message);
      break;
  }
  connection.statesAreDue = model.statesAreDue();
  watcher.look();
  schedule();
}

function told(answer: Answer, options: Options): void {
  if (options.quiet || answer.phase === "accepted") return;
  const good = isGood(answer);
  // A jog that ended when it was let go is no news.
  if (answer.request === "jog" && good) return;
  const level = good ? "ok" : answer.outcome === "stopped" ? "warning" : "error";
  const what = answer.phase === "result" ? answer.outcome : answer.phase;
  const reason = answer.reason === "" || answer.reason === what ? "" : `: ${answer.reason}`;
  const took = answer.phase === "result" ? ` (${short(answer.tookMs / 1000, 3)} s)` : "";
  const of = model.daemons.size > 1 ? `${answer.daemon}: ` : "";
  const text = `${of}${answer.request}${subjectOf(answer.fields)} ${what}${reason}${took}`;
  log.add(level, text);
  notices.add(level, text);
}

// " theta", " theta, phi", " of all": whom a request was about.
function subjectOf(fields: object): string {
  const told = fields as { motor?: unknown; motors?: unknown; table?: unknown };
  if (typeof told.motor === "string") return ` ${told.motor}`;
  if (typeof told.table === "string") return ` ${told.table}`;
  if (!Array.isArray(told.motors)) return "";
  const names = told.motors.map((one: string | { motor: string }) =>
    typeof one === "string" ? one : one.motor);
  if (names.length === 0) return " of all";
  return ` ${names.slice(0, 4).join(", ")}${names.length > 4 ? ` and ${names.length - 4} more` : ""}`;
}

function navigate(): void {
  viewAddress = location.hash;
  view?.close();
  view = viewOf(app, location.hash);
  scroller.replaceChildren(view.root);
  scroller.scrollTop = 0;
  document.title = view.title === "" ? "bushd" : `${view.title} – bushd`;
  header.update();
  view.update({ ...noChanges(), structure: true, rights: true, health: true });
}

connection.onMessage = take;
let wasOpen = false;
connection.onState = (state) => {
  // Attempts are not logged one by one.
  const isOpen = connection.isOpen();
  if (isOpen !== wasOpen) {
    log.add(isOpen ? "ok" : "error", isOpen ? "connected to bushd-web" : "the connection to bushd-web is lost");
  }
  wasOpen = isOpen;
  if (state === "closed") requests.lose();
  header.update();
  stopBar.update();
  view?.tick();
};
requests.onAnswer = told;

function tick(): void {
  connection.check();
  header.update();
  stopBar.update();
  view?.tick();
  schedule();
}

document.body.append(header.root, scroller, notices.root, stopBar.root);
put(document.body.querySelector("noscript") ?? el("span"), "");
window.addEventListener("hashchange", navigate);
window.addEventListener("online", () => { if (!connection.isOpen()) connection.reconnect(); });
navigate();
connection.start();
setInterval(tick, kTickMs);
