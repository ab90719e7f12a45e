// A picture becomes a plan: its scale, and what stands on it when the scale changes.

import { cm } from "./building.js";

/** Least and most metres a pixel, as the console allows. */
export const LEAST_SCALE = 0.0005;
export const MOST_SCALE = 0.5;
/** A usual door between its posts, metres. */
export const DOOR_M = 0.9;

/** A picture before anybody has measured on it: as if the longer side of it were 30 m. */
export function firstReading(width, height) {
  return { metres_per_pixel: bounded(30 / Math.max(width, height, 1)), measured: false, dark_below: 128, walls: [], wiped: [] };
}

function bounded(scale) {
  return Math.min(Math.max(scale, LEAST_SCALE), MOST_SCALE);
}

/**
 * By how much all lengths grow when the distance between two places (metres at the present scale) is really `metres`; null when the
 * places are one, or the scale would be none that can be.
 */
export function growth(reading, a, b, metres) {
  const drawn = Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m);
  if (!(drawn > 0) || !(metres > 0) || !Number.isFinite(metres)) return null;
  const ratio = metres / drawn;
  const scale = reading.metres_per_pixel * ratio;
  return scale >= LEAST_SCALE && scale <= MOST_SCALE ? ratio : null;
}

/** Everything drawn so far stays where it is on the picture. */
export function grown({ building, reading }, ratio) {
  const m = (value) => cm(value * ratio);
  const pairs = (corners) => corners.map(([x, y]) => [m(x), m(y)]);
  const area = (one) => (one.polygon ? { ...one, polygon: pairs(one.polygon) } : { ...one, rectangle: one.rectangle.map(m) });
  const place = (one) => ({ ...one, x: m(one.x), y: m(one.y) });
  return {
    building: {
      ...building,
      pad: building.pad && place(building.pad),
      doors: building.doors.map((door) => ({ ...door, a: pairs([door.a])[0], b: pairs([door.b])[0] })),
      rooms: building.rooms.map(area), no_fly: building.no_fly.map(area), privacy: building.privacy.map(area),
      round: { ...building.round, points: building.round.points.map(place) },
    },
    reading: {
      ...reading, metres_per_pixel: reading.metres_per_pixel * ratio, measured: true,
      walls: reading.walls.map((line) => line.map(m)), wiped: reading.wiped.map((box) => box.map(m)),
    },
  };
}

/** How large the picture is, metres. */
export function extent(draft, reading) {
  return { left: 0, bottom: 0, right: draft.width * reading.metres_per_pixel, top: draft.height * reading.metres_per_pixel };
}

/** What the console is sent to make a plan of it. */
export function making({ building, reading }) {
  const { metres_per_pixel, dark_below, walls, wiped } = reading;
  return { metres_per_pixel, origin: [0, 0], dark_below, walls, wiped, building };
}

/** A state as the console has kept it, or the first one. */
export function stateOf({ draft, plan }, building) {
  if (!plan) return { building, reading: firstReading(draft.width, draft.height) };
  const { metres_per_pixel, dark_below, walls, wiped } = plan.reading;
  return { building: plan.building, reading: { metres_per_pixel, measured: true, dark_below, walls, wiped } };
}
