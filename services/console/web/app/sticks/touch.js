// Two sticks and a button on the screen, by pointer events.

import { deadBand } from "../pure/mapping.js";
import { h, icon } from "../view/dom.js";

const BAND = 0.1;
/** Arrow keys move a stick by so much of its way. */
const KEY_STEP = 0.5;

export class Touch {
  constructor(liveness, moved) {
    this.liveness = liveness;
    this.moved = moved;
    this.sticks = { left: { x: 0, y: 0 }, right: { x: 0, y: 0 } };
    this.held = false;
    this.resets = [];
  }
  get wish() {
    const { left, right } = this.sticks;
    return {
      up: deadBand(left.y, BAND), turn: 0 - deadBand(left.x, BAND),
      forward: deadBand(right.y, BAND), left: 0 - deadBand(right.x, BAND),
      held: this.held, arm: "absent",
    };
  }
  input() {
    this.liveness.touched(performance.now());
    this.moved();
  }
  letGo() {
    this.held = false;
    for (const stick of Object.values(this.sticks)) Object.assign(stick, { x: 0, y: 0 });
    for (const reset of this.resets) reset();
  }
  /** A stick: `name` "left" or "right", `words` its name, `ends` {up, right, down, left} words at its ends. */
  stick(name, words, ends) {
    const knob = h("span", { class: "stick-knob" });
    const element = h("div", { class: "stick", tabindex: "0", role: "application", "aria-label": words },
      Object.entries(ends).map(([side, label]) => h("span", { class: `stick-end ${side}`, "aria-hidden": "true" }, label)), knob);
    const state = this.sticks[name];
    let pointer = null;
    const draw = () => {
      knob.style.setProperty("--x", state.x.toFixed(3));
      knob.style.setProperty("--y", (-state.y).toFixed(3));
      element.dataset.active = String(pointer !== null);
    };
    const set = (x, y) => {
      const size = Math.max(1, Math.hypot(x, y));
      state.x = x / size;
      state.y = y / size;
      draw();
      this.input();
    };
    const at = (event) => {
      const box = element.getBoundingClientRect();
      const reach = box.width * 0.36;
      set((event.clientX - box.left - box.width / 2) / reach, (box.top + box.height / 2 - event.clientY) / reach);
    };
    const release = () => {
      pointer = null;
      state.x = 0;
      state.y = 0;
      draw();
    };
    element.addEventListener("pointerdown", (event) => {
      if (pointer !== null) return;
      event.preventDefault();
      pointer = event.pointerId;
      element.setPointerCapture(pointer);
      at(event);
    });
    for (const kind of ["pointermove", "pointerrawupdate"]) {
      element.addEventListener(kind, (event) => {
        if (event.pointerId === pointer) at(event);
      });
    }
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
      element.addEventListener(kind, (event) => {
        if (event.pointerId !== pointer) return;
        release();
        this.input();
      });
    }
    element.addEventListener("keydown", (event) => {
      const way = { ArrowUp: [0, 1], ArrowDown: [0, -1], ArrowLeft: [-1, 0], ArrowRight: [1, 0] }[event.key];
      if (!way) return;
      event.preventDefault();
      event.stopPropagation();
      set(way[0] * KEY_STEP, way[1] * KEY_STEP);
    });
    element.addEventListener("keyup", (event) => {
      if (!event.key.startsWith("Arrow")) return;
      release();
      this.input();
    });
    this.resets.push(release);
    draw();
    return element;
  }
  /** The button that is held to fly. */
  holdButton(words, hint) {
    const element = h("button", { type: "button", class: "hold-fly", "aria-pressed": "false" }, icon("hand"), h("span", { class: "label" }, words), h("small", {}, hint));
    let pointer = null;
    const set = (held) => {
      if (this.held === held) return;
      this.held = held;
      element.setAttribute("aria-pressed", String(held));
      this.input();
    };
    element.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      pointer = event.pointerId;
      element.setPointerCapture(pointer);
      element.focus({ preventScroll: true });
      set(true);
    });
    for (const kind of ["pointermove", "pointerrawupdate"]) {
      element.addEventListener(kind, (event) => {
        if (event.pointerId === pointer && this.held) this.input();
      });
    }
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture"]) {
      element.addEventListener(kind, (event) => {
        if (event.pointerId !== pointer) return;
        pointer = null;
        set(false);
      });
    }
    element.addEventListener("keydown", (event) => {
      if (event.code !== "Space" && event.code !== "Enter") return;
      event.preventDefault();
      if (this.held) this.input();
      else set(true);
    });
    element.addEventListener("keyup", () => set(false));
    element.addEventListener("blur", () => set(false));
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    this.resets.push(() => {
      pointer = null;
      this.held = false;
      element.setAttribute("aria-pressed", "false");
    });
    return element;
  }
  /** The panel is drawn anew: old elements are forgotten. */
  forget() {
    this.letGo();
    this.resets = [];
  }
}
