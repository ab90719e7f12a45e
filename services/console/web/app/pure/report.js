// A report as the console keeps it, with everything that may be absent filled in.

import { list } from "./lists.js";
import { ROOMS } from "./codes.js";

const OUTCOMES = {
  landed_on_pad: { key: "outcome.landed_on_pad", tone: "good" },
  landed_elsewhere: { key: "outcome.landed_elsewhere", tone: "caution" },
  emergency_landing: { key: "outcome.emergency_landing", tone: "alarm" },
  cut: { key: "outcome.cut", tone: "alarm" },
  contact: { key: "outcome.contact", tone: "alarm" },
  timeout: { key: "outcome.timeout", tone: "alarm" },
  lost_contact: { key: "outcome.lost_contact", tone: "alarm" },
};

/** Key of the words and tone for an outcome; a key of null for one that this page does not know. */
export function outcomeOf(outcome) {
  return OUTCOMES[String(outcome).replaceAll(" ", "_")] ?? { key: null, tone: "caution" };
}

function roomOf(room) {
  const word = String(room.state ?? "waiting").replace("partly seen", "partly").replaceAll(" ", "_");
  const state = typeof room.state === "number" ? ROOMS[room.state] : word;
  return {
    name: String(room.name ?? ""),
    state: ROOMS.includes(state) ? state : "waiting",
    seen: Math.min(Math.max(Number(room.seen) || 0, 0), 1),
    reason: room.reason ?? "",
    entered_ms: room.entered_ms ?? null,
    left_ms: room.left_ms ?? room.seen_ms ?? null,
  };
}

/** Something with a beginning and an end; `action` is what a failsafe did. */
function spanOf(one) {
  return { time_ms: one.time_ms ?? null, ended_ms: one.ended_ms ?? null, text: one.text ?? "", action: one.action ?? "" };
}

export function reportOf(value) {
  const report = value ?? {};
  return {
    drone: report.drone ?? "",
    started_ms: report.started_ms ?? null,
    landed_ms: report.landed_ms ?? null,
    outcome: report.outcome ?? "",
    coverage: Number(report.coverage) || 0,
    text: report.text ?? "",
    rooms: list(report.rooms, "rooms").map(roomOf),
    incidents: list(report.incidents, "incidents").map((one) => ({ id: one.id ?? null, time_ms: one.time_ms, text: one.text ?? "", account: one.account ?? "", x_m: one.x_m ?? null, y_m: one.y_m ?? null })),
    failsafes: list(report.failsafes).map(spanOf),
    flown_by: list(report.flown_by).map(spanOf),
    silences: list(report.silences).map(spanOf),
  };
}
