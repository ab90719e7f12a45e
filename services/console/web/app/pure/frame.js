// One message of `/ws/sticks`, and when the next is due.

/** While the button is held, and while the sticks are had but not flown by. */
export const HELD_MS = 20;
export const IDLE_MS = 50;
/** The drone takes a hundred messages a second: new input is sent at once while one is saved up, else as the next is due. */
export const LEAST_MS = 10;
const SAVED = 2;

const NOTHING = { forward: 0, left: 0, up: 0, turn: 0, held: false, arm: "absent" };

/**
 * The message, or null when there is nothing to be said: no lease, or no input ever. Where `frozen` says that input does not
 * count, the button reads as let go: releasing never waits for liveness.
 */
export function frame(lease, liveness, wish, switches, now) {
  if (!lease || !liveness.tied) return null;
  const blocked = liveness.blocks.size > 0;
  const { forward, left, up, turn, held, arm } = blocked ? { ...NOTHING, arm: wish.arm } : wish;
  return {
    lease,
    input_sequence: liveness.sequence,
    beacon_ns: liveness.tied.beacon_ns,
    since_ms: Math.round(liveness.tied.since_ms * 1000) / 1000,
    forward: round(forward), left: round(left), up: round(up), turn: round(turn),
    held: Boolean(held),
    height_hold: switches.height_hold,
    heading_hold: switches.heading_hold,
    arm,
  };
}

function round(value) {
  return Math.round(Math.min(1, Math.max(-1, value)) * 1000) / 1000 + 0;
}

/** Whether a frame is due: at once when the input is new, else at its rate. */
export class Pace {
  constructor() {
    this.sent = null;
    this.sequence = -1;
    this.held = false;
    this.saved = SAVED;
  }
  due(sequence, held, now) {
    if (held !== this.held || this.sent === null) return true;
    if (sequence !== this.sequence) return this.savedBy(now) >= 1;
    return now - this.sent >= (held ? HELD_MS : IDLE_MS) - 1;
  }
  mark(sequence, held, now) {
    this.saved = Math.max(0, this.savedBy(now) - 1);
    this.sequence = sequence;
    this.held = held;
    this.sent = now;
  }
  savedBy(now) {
    return this.sent === null ? SAVED : Math.min(SAVED, this.saved + (now - this.sent) / LEAST_MS);
  }
}

/** Joins sources: the first with a wish other than zero flies; any source's button holds. */
export function join(wishes) {
  const active = wishes.find((wish) => wish && (wish.forward || wish.left || wish.up || wish.turn)) ?? NOTHING;
  return {
    forward: active.forward, left: active.left, up: active.up, turn: active.turn,
    held: wishes.some((wish) => wish?.held),
    arm: wishes.find((wish) => wish && wish.arm !== "absent")?.arm ?? "absent",
  };
}
