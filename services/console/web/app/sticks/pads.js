// Gamepads and radio transmitters, as the browser shows them; mappings are kept by the device's name.

import { apply, defaultMapping, fits, recognise } from "../pure/mapping.js";

const KEY = "sereno.mapping.";
/** Out of the middle of a stick; a throttle without a spring needs no more, since height hold takes over. */
const DEAD_BAND = 0.08;

export class Pads {
  constructor(liveness) {
    this.liveness = liveness;
    this.chosen = null;
    this.known = null;
    this.mapping = null;
  }
  /** All devices, in the browser's order. */
  list() {
    return [...(navigator.getGamepads?.() ?? [])].filter(Boolean);
  }
  /** The device in use: the one chosen, else the first that can fly. */
  get device() {
    const all = this.list();
    return all.find((pad) => pad.index === this.chosen) ?? all.find((pad) => !recognise(pad).error) ?? null;
  }
  /** A device that is there but cannot fly, with why. */
  get unfit() {
    if (this.device) return null;
    const pad = this.list()[0];
    return pad ? { id: pad.id, ...recognise(pad) } : null;
  }
  keep(pad, mapping) {
    this.mapping = mapping;
    try {
      localStorage.setItem(KEY + pad.id, JSON.stringify(mapping));
    } catch {
      // Used until the page is closed.
    }
  }
  read(pad) {
    try {
      const kept = JSON.parse(localStorage.getItem(KEY + pad.id));
      if (fits(kept, pad)) return kept;
    } catch {
      // Nothing kept, or nothing that can be read.
    }
    return defaultMapping(pad);
  }
  /** The wish of the device now, null without one. Counts its input. */
  look(now) {
    const pad = this.device;
    if (!pad || !pad.connected) {
      if (this.known !== null) {
        this.known = null;
        this.mapping = null;
        this.liveness.lostGamepad();
      }
      return null;
    }
    if (this.known !== pad.id) {
      this.known = pad.id;
      this.mapping = this.read(pad);
      this.liveness.newGamepad();
    }
    if (!this.mapping) return null;
    this.liveness.gamepad(pad.timestamp, now);
    const wish = apply(pad, this.mapping, DEAD_BAND);
    return { ...wish, held: wish.held === true };
  }
}
