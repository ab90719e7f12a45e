// What the numbers in the drone's messages stand for: the enumerations of `ipc-types`, as keys of the word lists.

/** Phase of the flight, `pilot/state` phase. */
export const PHASES = ["grounded", "arming", "takeoff", "hover", "autonomous", "manual", "landing", "emergency", "cut"];

/** What a failsafe is about, `pilot/state` cause. */
export const CAUSES = [
  "none", "navigation", "operator_silent", "side_sonar", "pose", "all_sonars", "battery_return", "battery_land",
  "lost", "height", "link", "tilt", "operator",
];

/** What a failsafe does, `pilot/state` action and the "if lost now" fields. */
export const ACTIONS = ["none", "hover", "return", "land", "descend", "cut"];

/** How far a human has the drone in hand, `pilot/state` sticks. */
export const STICKS = ["free", "stopping", "neutral", "ready", "following", "silent"];

/** How the round goes, `navigation/patrol` state. */
export const PATROL = ["idle", "planning", "flying", "paused", "returning", "landing", "done", "failed", "going"];

/** How far a room has been seen, `navigation/patrol` rooms. */
export const ROOMS = ["waiting", "entered", "seen", "skipped", "partly"];

/** Why a direction was chosen, `navigation/polar` reason. */
export const REASONS = ["holding", "straight", "narrow", "wide", "blocked", "blind", "backing", "deflected"];

/** How far the place is known, `localization/pose` state. */
export const LOCALIZATION = ["lost", "converging", "tracking"];

/** What a ping brought back, `sonar/ranges` status. */
export const SONAR = ["never", "ok", "no_echo", "fault"];

/** `pilot/state` answer and `navigation/patrol` answer. */
export const ANSWERS = ["none", "working", "accepted", "refused"];

/** The word for `code` in `list`; "unknown" for a code that this page does not know. */
export function word(list, code) {
  return list[code] ?? "unknown";
}

/** Phases in which the drone is off the ground or about to be. */
export function inFlight(phase) {
  return phase >= 2 && phase <= 7;
}

/** The causes in the bit set `causes` of `pilot/state`, most severe first. */
export function causesIn(causes) {
  const found = [];
  for (let code = CAUSES.length - 1; code > 0; code -= 1) {
    if (causes & (1 << code)) found.push(code);
  }
  return found;
}
