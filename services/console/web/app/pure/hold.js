// A button that works only when it is held for long enough.

/** Feed it with `press`, `release` and `look`; `progress` is 0..1, `look` is true once, when the time is full. */
export class Hold {
  constructor(length_ms) {
    this.length = length_ms;
    this.since = null;
    this.done = false;
  }
  press(now) {
    if (this.since !== null) return;
    this.since = now;
    this.done = false;
  }
  release() {
    this.since = null;
  }
  progress(now) {
    return this.since === null ? 0 : Math.min((now - this.since) / this.length, 1);
  }
  look(now) {
    if (this.since === null || this.done || now - this.since < this.length) return false;
    this.done = true;
    return true;
  }
}
