// Learning which axis is which: the human moves one stick after the other, nothing else.

/** The steps, in order. The last two may be skipped. */
export const STEPS = ["throttle", "aileron", "elevator", "rudder", "arm", "hold"];
const MAY_SKIP = ["arm", "hold"];

/** An axis must go so far from where it stood when the step began (an axis is two long). */
export const TRAVEL = 0.6;
/** Nothing may have moved by more than this for so long before the next step begins. */
const REST = 0.08;
const REST_MS = 350;

/** Feed it with `sample`; read `step`, `phase` ("rest": let go first, "move": now) and at the end `mapping`. */
export class Wizard {
  constructor() {
    this.at = 0;
    this.phase = "rest";
    this.mapping = {};
    this.before = null;
    this.since = null;
    this.base = null;
  }
  get step() {
    return STEPS[this.at] ?? null;
  }
  get done() {
    return this.at >= STEPS.length;
  }
  get maySkip() {
    return MAY_SKIP.includes(this.step);
  }
  skip() {
    if (!this.maySkip) return;
    this.mapping[this.step] = null;
    this.next();
  }
  next() {
    this.at += 1;
    this.phase = "rest";
    this.before = null;
    this.since = null;
  }
  /** `device` is {axes, buttons}, `now` milliseconds. */
  sample(device, now) {
    if (this.done) return;
    const state = [...device.axes, ...device.buttons.map((button) => (button.pressed ? 1 : 0))];
    if (this.phase === "rest") {
      const still = this.before?.length === state.length && state.every((value, k) => Math.abs(value - this.before[k]) <= REST);
      if (!still) {
        this.before = state;
        this.since = now;
      } else if (now - this.since >= REST_MS) {
        this.base = this.before;
        this.phase = "move";
      }
      return;
    }
    if (state.length !== this.base.length) {
      this.phase = "rest";
      this.before = null;
      return;
    }
    const found = this.moved(device, state);
    if (!found) return;
    this.mapping[this.step] = found;
    this.next();
  }
  moved(device, state) {
    const taken = new Set(Object.values(this.mapping).map((input) => input?.axis));
    let best = null;
    for (let axis = 0; axis < device.axes.length; axis += 1) {
      const way = state[axis] - this.base[axis];
      if (taken.has(axis) || Math.abs(way) < TRAVEL) continue;
      if (!best || Math.abs(way) > Math.abs(best.way)) best = { axis, way };
    }
    if (best) return { axis: best.axis, sign: Math.sign(best.way) };
    if (!this.maySkip) return null;
    const used = new Set(Object.values(this.mapping).map((input) => input?.button));
    for (let button = 0; button < device.buttons.length; button += 1) {
      if (!used.has(button) && state[device.axes.length + button] > this.base[device.axes.length + button]) return { button };
    }
    return null;
  }
}
