// What was done can be undone.

const MOST = 200;

export class History {
  constructor(state) {
    this.begin(state);
  }
  /** Nothing has been done yet. */
  begin(state) {
    this.base = state;
    this.past = [];
    this.now = state;
    this.future = [];
    this.tag = null;
  }
  /** A new state. Steps with the same `tag` in a row are one: a drag, a slider, a name being typed. */
  push(state, tag = null) {
    if (state === this.now) return;
    if (tag === null || tag !== this.tag) this.past.push(this.now);
    if (this.past.length > MOST) this.past.shift();
    this.now = state;
    this.future = [];
    this.tag = tag;
  }
  /** The next step is one of its own, whatever its tag. */
  settle() {
    this.tag = null;
  }
  get canUndo() {
    return this.past.length > 0;
  }
  get canRedo() {
    return this.future.length > 0;
  }
  undo() {
    if (!this.canUndo) return;
    this.future.push(this.now);
    this.now = this.past.pop();
    this.tag = null;
  }
  redo() {
    if (!this.canRedo) return;
    this.past.push(this.now);
    this.now = this.future.pop();
    this.tag = null;
  }
}
