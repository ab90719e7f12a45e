// The keyboard as sticks. Key events count as input, repeated ones too: those come from a key that is still down.

import { flies, wishOf } from "../pure/keys.js";

export class Keyboard {
  constructor(liveness, moved) {
    this.liveness = liveness;
    this.moved = moved;
    this.down = new Set();
    this.onDown = (event) => this.key(event, true);
    this.onUp = (event) => this.key(event, false);
  }
  get wish() {
    return wishOf(this.down);
  }
  begin() {
    addEventListener("keydown", this.onDown);
    addEventListener("keyup", this.onUp);
  }
  finish() {
    removeEventListener("keydown", this.onDown);
    removeEventListener("keyup", this.onUp);
    this.letGo();
  }
  letGo() {
    this.down.clear();
  }
  key(event, down) {
    if (!event.isTrusted || event.ctrlKey || event.altKey || event.metaKey || !flies(event.code)) return;
    if (down && elsewhere(event.target, event.code)) return;
    event.preventDefault();
    if (down) this.down.add(event.code);
    else this.down.delete(event.code);
    this.liveness.touched(performance.now());
    this.moved();
  }
}

/** Whether the key belongs to what has the focus: text, a choice, or the space that presses a button. */
function elsewhere(target, code) {
  if (!(target instanceof Element)) return false;
  if (target.closest("input, select, textarea, dialog, [contenteditable]")) return true;
  return code === "Space" && target.closest("button, a, summary") !== null;
}
