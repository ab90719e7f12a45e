// One watched drone: what it is, what was last heard of it, and what follows from that. Panels read it; it knows no panel.

import * as api from "../net/api.js";
import { Telemetry } from "../net/telemetry.js";
import { aboutOf } from "../pure/about.js";
import { Alarms } from "../pure/alarms.js";
import { MeanCurrent, battery } from "../pure/battery.js";
import { clusters } from "../pure/clusters.js";
import { Chronicle } from "../pure/chronicle.js";
import { Trail } from "../pure/trail.js";
import { trust } from "../pure/trust.js";
import { Control } from "../sticks/control.js";

const ALWAYS = ["localization/pose", "pilot/state", "flight/power", "flight/state", "navigation/patrol"];
/** Topics of each layer that can be switched on. */
export const LAYERS = {
  seen: [], route: [], path: [],
  particles: ["localization/particles"],
  sonar: ["sonar/ranges"],
  grid: ["navigation/grid"],
  polar: ["navigation/polar"],
};
const FIRST_LAYERS = ["seen", "route", "path"];
const LAYERS_KEY = "sereno.layers";

function keptLayers() {
  try {
    const kept = JSON.parse(localStorage.getItem(LAYERS_KEY));
    return new Set(Array.isArray(kept) ? kept.filter((name) => name in LAYERS) : FIRST_LAYERS);
  } catch {
    return new Set(FIRST_LAYERS);
  }
}

export class WatchSession extends EventTarget {
  constructor(drone, account) {
    super();
    this.drone = drone;
    this.account = account;
    this.mayOrder = account.role !== "viewer";
    this.about = null;
    this.aboutError = null;
    this.trail = new Trail();
    this.alarms = new Alarms();
    this.chronicle = new Chronicle(Date.now());
    this.current = new MeanCurrent();
    this.sonars = new Map();
    this.places = [];
    /** What was last told of its recording, and when. */
    this.recording = null;
    this.layers = keptLayers();
    this.telemetry = new Telemetry(drone, {
      heard: (topic, data) => this.heard(topic, data),
      event: (line) => this.chronicle.told(line, Date.now()),
      link: () => {
        // One that was away may have come back with another plan.
        if (this.away && this.telemetry.alive) this.load();
        this.away = this.telemetry?.alive === false;
        this.tell("link");
      },
      recording: (told) => {
        this.recording = { told, at: performance.now() };
        this.tell("recording");
      },
    });
    this.again = () => this.load();
    addEventListener("sereno:building", this.again);
    this.control = this.mayOrder ? new Control(drone, () => this.pilot, account) : null;
    this.want();
    this.ended = false;
    this.load();
  }
  async load() {
    try {
      const about = aboutOf(await api.about(this.drone));
      if (JSON.stringify(about) !== JSON.stringify(this.about)) this.about = about;
      this.aboutError = null;
    } catch (error) {
      this.aboutError = error;
      if (!this.ended) this.retry = setTimeout(() => this.load(), 3000);
    }
    if (!this.ended) this.tell("about");
  }
  tell(name) {
    this.dispatchEvent(new Event(name));
  }
  get pose() {
    return this.telemetry.latest["localization/pose"] ?? null;
  }
  get pilot() {
    return this.telemetry?.latest["pilot/state"] ?? null;
  }
  get patrol() {
    return this.telemetry.latest["navigation/patrol"] ?? null;
  }
  get polar() {
    return this.telemetry.latest["navigation/polar"] ?? null;
  }
  get grid() {
    return this.telemetry.latest["navigation/grid"] ?? null;
  }
  get particles() {
    return this.telemetry.latest["localization/particles"] ?? null;
  }
  get trust() {
    return trust(this.pose, this.unsure ? this.places.length : null);
  }
  /** Whether hypotheses may compete, so that the particles are worth their bytes. */
  get unsure() {
    return Boolean(this.pose && (this.pose.state !== 2 || this.pose.searching || this.pose.p_lost > 0.05));
  }
  get battery() {
    return battery(this.telemetry.latest["flight/power"] ?? null, this.about?.capacity_mah ?? null, this.current.value);
  }
  setLayer(name, on) {
    if (on) this.layers.add(name);
    else this.layers.delete(name);
    try {
      localStorage.setItem(LAYERS_KEY, JSON.stringify([...this.layers]));
    } catch {
      // They are as they were at the next visit.
    }
    this.want();
    this.tell("layers");
  }
  want() {
    const topics = new Set(ALWAYS);
    for (const name of this.layers) for (const topic of LAYERS[name]) topics.add(topic);
    if (this.unsure) topics.add("localization/particles");
    this.telemetry.want(topics);
  }
  heard(topic, data) {
    const now = performance.now();
    switch (topic) {
      case "localization/pose":
        this.trail.add(data, this.pilot);
        this.want();
        break;
      case "localization/particles":
        this.places = clusters(data);
        break;
      case "flight/power":
        this.current.add(data.amps, now);
        break;
      case "sonar/ranges":
        for (const reading of (data.readings ?? []).slice(0, data.count)) this.sonars.set(reading.sensor, { ...reading, at: now });
        break;
      default:
    }
    if (topic === "pilot/state" || topic === "navigation/patrol") {
      this.chronicle.look(this.pilot, this.patrol, this.pose, Date.now());
      this.alarms.look(this.pilot, this.pose, this.patrol);
      this.control?.state();
    }
    this.tell(topic);
  }
  /** Gives an order and writes it and its answer into the event log. */
  async order(verb, more = {}) {
    const result = await this.telemetry.orders.give(verb, more);
    this.chronicle.ordered(verb, result, Date.now());
    return result;
  }
  end() {
    this.ended = true;
    removeEventListener("sereno:building", this.again);
    clearTimeout(this.retry);
    this.control?.end();
    this.telemetry.end();
  }
}
