// One still picture a second, for a browser that cannot decode the drone's video.

import { stillUrl } from "../net/api.js";

const EVERY_MS = 1000;

/** Asks for stills while it runs and the page can be seen; nobody asks, and the drone's camera sleeps. */
export class Stills {
  /** `image`: where they are shown; `told(sentence)`: called after each question, with "" when a picture came. */
  constructor(drone, image, told) {
    this.url = stillUrl(drone);
    this.image = image;
    this.told = told;
    this.takenAt = null;
    this.running = false;
  }
  start() {
    if (this.running) return;
    this.running = true;
    this.ask();
  }
  stop() {
    this.running = false;
    clearTimeout(this.timer);
    this.show(null);
  }
  async ask() {
    const began = performance.now();
    if (!document.hidden) await this.once();
    if (this.running) this.timer = setTimeout(() => this.ask(), Math.max(100, EVERY_MS - (performance.now() - began)));
  }
  async once() {
    try {
      const response = await fetch(this.url, { credentials: "same-origin", cache: "no-store" });
      const picture = response.ok ? await response.blob() : null;
      const why = response.ok ? "" : ((await response.json()).error ?? "");
      if (!this.running) return;
      if (picture) {
        // Where the drone's clock is not known yet, its age counts from its arrival.
        const age = Number(response.headers.get("x-sereno-age-ms") ?? 0);
        this.takenAt = performance.now() - (Number.isFinite(age) ? age : 0);
        this.show(picture);
      }
      this.told(why);
    } catch {
      if (this.running) this.told("");
    }
  }
  show(picture) {
    const before = this.shown;
    this.shown = picture ? URL.createObjectURL(picture) : null;
    if (this.shown) this.image.src = this.shown;
    else {
      this.image.removeAttribute("src");
      this.takenAt = null;
    }
    if (before) URL.revokeObjectURL(before);
  }
}
