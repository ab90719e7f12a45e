// The path flown, as the drone believed it.

import { inFlight } from "./codes.js";

const STEP_M = 0.05;
const MOST = 8000;

/** Points of the present flight, oldest first: {x_m, y_m, gap} where `gap` says that the line does not come from the point before. */
export class Trail {
  constructor() {
    this.points = [];
    this.flying = false;
    this.gap = true;
  }
  add(pose, pilot) {
    const flying = Boolean(pilot && inFlight(pilot.phase));
    if (flying && !this.flying) {
      this.points = [];
      this.gap = true;
    }
    this.flying = flying;
    if (!flying || pose.searching || pose.state === 0 || pose.x_m === null) {
      this.gap = true;
      return;
    }
    const last = this.points.at(-1);
    const far = last ? Math.hypot(pose.x_m - last.x_m, pose.y_m - last.y_m) : Infinity;
    if (far < STEP_M && !this.gap) return;
    // A jump of the estimate is no flight.
    this.points.push({ x_m: pose.x_m, y_m: pose.y_m, gap: this.gap || far > 1.5 });
    this.gap = false;
    if (this.points.length > MOST) this.points.splice(0, MOST / 4);
  }
}
