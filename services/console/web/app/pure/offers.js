// Which orders make sense now. The drone decides; this only keeps buttons away that it would refuse anyway.

import { PATROL, PHASES, inFlight, word } from "./codes.js";

/**
 * {primary: {verb, key}, pause, stopRound, takeoff, goto, home, land, cut: booleans, automatic: true | false | null}. Stop is always
 * offered. Without news nothing else is kept away: old news is no reason to refuse a guard.
 */
export function offers(pilot, patrol) {
  const phase = pilot ? word(PHASES, pilot.phase) : "unknown";
  const round = patrol ? word(PATROL, patrol.state) : "unknown";
  const flying = pilot ? inFlight(pilot.phase) : true;
  const coming = phase === "landing" || phase === "emergency";
  const underway = flying && ["planning", "flying", "returning", "landing"].includes(round);
  const paused = flying && round === "paused";
  return {
    primary: paused ? { verb: "patrol-start", key: "order.resume" } : underway ? { verb: "patrol-pause", key: "order.pause" } : { verb: "patrol-start", key: "order.start" },
    primaryReady: !coming && phase !== "cut",
    pause: underway && !coming,
    stopRound: (underway || paused) && round !== "returning",
    takeoff: phase === "grounded",
    goto: flying && !coming && phase !== "arming",
    home: flying && !coming,
    land: flying && phase !== "arming",
    cut: flying || phase === "arming" || phase === "unknown",
    automatic: pilot?.automatic === undefined ? null : pilot.automatic === 1,
  };
}
