// Whether a human's hand is behind what the sticks say. Only new input counts; nothing here repeats anything.

/** Without a new input for so long the drone hovers, so the page says that nothing comes. */
export const SILENT_MS = 250;
/** Without a beacon for so long an input's age cannot be told, so it does not count. */
export const BEACON_MS = 500;

/**
 * Counts real input and ties each to the newest beacon at that moment. `block` and `unblock` say why input cannot be
 * trusted: "hidden", "blurred", "unplugged", "timestamps", ...
 */
export class Liveness {
  constructor() {
    this.sequence = 0;
    this.at = null;
    this.tied = null;
    this.beacon = null;
    this.blocks = new Set();
    this.timestamp = null;
  }
  /** The drone's clock was heard. */
  heardBeacon(beacon_ns, now) {
    this.beacon = { beacon_ns, at: now };
  }
  block(reason) {
    this.blocks.add(reason);
  }
  unblock(reason) {
    this.blocks.delete(reason);
  }
  /** A hand moved at `now`. False when that cannot count. */
  input(now) {
    if (this.blocks.size > 0) return false;
    if (!this.beacon || now - this.beacon.at > BEACON_MS) return false;
    this.sequence += 1;
    this.at = now;
    this.tied = { beacon_ns: this.beacon.beacon_ns, since_ms: Math.max(0, now - this.beacon.at) };
    return true;
  }
  /** A hand moved a key or the screen: also the way on after a gamepad was pulled out. */
  touched(now) {
    this.unblock("unplugged");
    return this.input(now);
  }
  /** A look at a gamepad: input only if its own timestamp has moved since the last look. */
  gamepad(timestamp, now) {
    const before = this.timestamp;
    this.timestamp = timestamp;
    if (before === null || timestamp === before) return false;
    return this.input(now);
  }
  /** Another device, or the same one again. */
  newGamepad() {
    this.timestamp = null;
    this.unblock("unplugged");
  }
  /** The device that was flown by is gone: nothing counts until it is back or another hand moves. */
  lostGamepad() {
    this.timestamp = null;
    this.block("unplugged");
  }
  /** Age of the newest input at the page, null before any. */
  age(now) {
    return this.at === null ? null : now - this.at;
  }
  /** Why nothing counts now, or null: a block, "beacon" or "silent". */
  frozen(now) {
    for (const reason of this.blocks) return reason;
    if (!this.beacon || now - this.beacon.at > BEACON_MS) return "beacon";
    const age = this.age(now);
    return age === null || age > SILENT_MS ? "silent" : null;
  }
}
