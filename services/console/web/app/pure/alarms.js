// What must be heard, and what has been acknowledged.

import { ACTIONS, CAUSES, inFlight, word } from "./codes.js";

/** Farther from the pad than this is elsewhere, metres. */
export const PAD_M = 0.6;

/**
 * Feed it with `look`; it keeps a list of alarms, {id, kind, cause, action}. An alarm that was acknowledged is silent until its
 * cause has gone and come again; "landed elsewhere" goes only when acknowledged or when the drone flies again.
 */
export class Alarms {
  constructor() {
    this.acknowledged = new Set();
    this.elsewhere = false;
    this.flew = false;
    this.active = [];
  }
  /** `pilot`, `pose`, `patrol` are the newest messages or null. Gives the alarms that stand now. */
  look(pilot, pose, patrol) {
    const now = [];
    const flying = pilot && inFlight(pilot.phase);
    if (flying) {
      this.flew = true;
      this.elsewhere = false;
    } else if (pilot && this.flew && (pilot.phase === 0 || pilot.phase === 8)) {
      this.flew = false;
      this.elsewhere = pilot.phase === 8 || offPad(pose, patrol);
    }
    const cause = pilot ? word(CAUSES, pilot.cause) : "none";
    const action = pilot ? word(ACTIONS, pilot.action) : "none";
    if (pilot && action !== "none" && cause !== "none" && cause !== "operator") {
      now.push({ id: `failsafe:${cause}:${action}`, kind: "failsafe", cause, action });
    }
    if (flying && pose && pose.state === 0 && !pose.searching && cause !== "pose" && cause !== "lost") {
      now.push({ id: "lost", kind: "lost", cause: "lost", action: "none" });
    }
    if (this.elsewhere) now.push({ id: "elsewhere", kind: "elsewhere", cause: "none", action: "none" });
    for (const id of this.acknowledged) if (!now.some((alarm) => alarm.id === id)) this.acknowledged.delete(id);
    this.active = now.map((alarm) => ({ ...alarm, acknowledged: this.acknowledged.has(alarm.id) }));
    return this.active;
  }
  /** Whether something must sound. */
  get sounding() {
    return this.active.some((alarm) => !alarm.acknowledged);
  }
  acknowledge() {
    for (const alarm of this.active) this.acknowledged.add(alarm.id);
    if (this.elsewhere) {
      this.elsewhere = false;
      this.acknowledged.delete("elsewhere");
    }
    this.active = this.active.filter((alarm) => alarm.kind !== "elsewhere").map((alarm) => ({ ...alarm, acknowledged: true }));
  }
}

function offPad(pose, patrol) {
  if (!pose || !patrol || pose.x_m === null || !Number.isFinite(patrol.pad_x_m)) return false;
  return pose.searching === 1 || Math.hypot(pose.x_m - patrol.pad_x_m, pose.y_m - patrol.pad_y_m) > PAD_M;
}
