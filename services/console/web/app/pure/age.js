// How old things are. Only the page's own monotonic clock and the drone's stamps are compared with themselves.

/** Milliseconds without news after which what is shown is called late, and after which it is called stale. */
export const LATE_MS = 1000;
export const STALE_MS = 2500;

/** "none", "live", "late" or "stale" for news that came at `arrived` (null: never). */
export function freshness(arrived, now) {
  if (arrived === null || arrived === undefined) return "none";
  const age = now - arrived;
  if (age >= STALE_MS) return "stale";
  return age >= LATE_MS ? "late" : "live";
}

/** An age in milliseconds as a number with a unit: {key: "ms" | "s" | "min" | "h", value: "0.3"}. */
export function ageParts(ms) {
  const age = Math.max(0, ms);
  if (age < 10_000) return { key: "s", value: (Math.floor(age / 100) / 10).toFixed(1) };
  if (age < 90_000) return { key: "s", value: String(Math.floor(age / 1000)) };
  if (age < 5_400_000) return { key: "min", value: String(Math.floor(age / 60_000)) };
  return { key: "h", value: String(Math.floor(age / 3_600_000)) };
}

/** Seconds from `earlier_ns` to `later_ns`, both of the drone's clock; null when either is absent (0). */
export function secondsBetween(earlier_ns, later_ns) {
  if (!earlier_ns || !later_ns) return null;
  return (later_ns - earlier_ns) / 1e9;
}

/** Minutes and seconds, "3:07". */
export function clock(seconds) {
  const whole = Math.max(0, Math.floor(seconds));
  const minutes = Math.floor(whole / 60);
  return `${minutes}:${String(whole % 60).padStart(2, "0")}`;
}

/**
 * The newest news of each topic and of the connection.
 * A topic that was never heard is "none"; the whole is as fresh as its freshest topic.
 */
export class News {
  constructor() {
    this.arrivals = new Map();
    this.newest = null;
  }
  heard(topic, now) {
    this.arrivals.set(topic, now);
    this.newest = now;
  }
  freshness(topic, now) {
    return freshness(this.arrivals.get(topic) ?? null, now);
  }
  whole(now) {
    return freshness(this.newest, now);
  }
  age(now) {
    return this.newest === null ? null : now - this.newest;
  }
}
