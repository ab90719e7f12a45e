// What lies under a pointer on the plan.

import { AREAS, cornersOf, itemsOf } from "./building.js";

const near = (ax, ay, bx, by) => Math.hypot(ax - bx, ay - by);

/** Whether (x, y) lies inside the outline (even-odd rule). */
export function inside(corners, x, y) {
  let odd = false;
  for (let k = 0, before = corners.length - 1; k < corners.length; before = k, k += 1) {
    const [ax, ay] = corners[k];
    const [bx, by] = corners[before];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
  }
  return odd;
}

function areaOf(corners) {
  const twice = corners.reduce((sum, [x, y], k) => {
    const [nx, ny] = corners[(k + 1) % corners.length];
    return sum + x * ny - nx * y;
  }, 0);
  return Math.abs(twice) / 2;
}

/** The corner of what is selected under (x, y), else the nearest thing: {kind, index, corner: number or null}; null for nothing. */
export function hit(building, x, y, reach_m, selected = null, kinds = ["pad", "points", "doors", ...AREAS]) {
  const one = selected && selected.kind !== "pad" ? itemsOf(building, selected.kind)[selected.index] : null;
  if (one) {
    const corners = one.a ? [one.a, one.b] : one.x === undefined ? cornersOf(one) : [];
    const corner = corners.findIndex(([cx, cy]) => near(cx, cy, x, y) <= reach_m);
    if (corner >= 0) return { kind: selected.kind, index: selected.index, corner };
  }
  if (kinds.includes("points")) {
    const index = building.round.points.findIndex((point) => near(point.x, point.y, x, y) <= reach_m);
    if (index >= 0) return { kind: "points", index, corner: null };
  }
  if (kinds.includes("pad") && building.pad && near(building.pad.x, building.pad.y, x, y) <= Math.max(reach_m, 0.3)) return { kind: "pad", index: 0, corner: null };
  if (kinds.includes("doors")) {
    const index = building.doors.findIndex(({ a, b }) => toLine(a, b, x, y) <= reach_m * 0.7);
    if (index >= 0) return { kind: "doors", index, corner: null };
  }
  let best = null;
  let least = Infinity;
  for (const kind of AREAS.filter((name) => kinds.includes(name))) {
    building[kind].forEach((area, index) => {
      const corners = cornersOf(area);
      const size = areaOf(corners) * (kind === "rooms" ? 1000 : 1);
      if (size < least && inside(corners, x, y)) [best, least] = [{ kind, index, corner: null }, size];
    });
  }
  return best;
}

function toLine([ax, ay], [bx, by], x, y) {
  const length = (bx - ax) ** 2 + (by - ay) ** 2 || 1e-9;
  const t = Math.min(Math.max(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0), 1);
  return near(x, y, ax + t * (bx - ax), ay + t * (by - ay));
}
