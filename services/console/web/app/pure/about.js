// What a drone says of itself, as the page needs it.

import { list } from "./lists.js";

function numberOr(...values) {
  return values.find((value) => typeof value === "number" && Number.isFinite(value)) ?? null;
}

/** A zone or room as {name, box: {left, bottom, right, top}, corners: [[x, y], ...]}; null when it has no place. */
function areaOf(one) {
  const corners = one.polygon ?? one.corners ?? null;
  if (Array.isArray(corners) && corners.length >= 3) {
    const points = corners.map((corner) => (Array.isArray(corner) ? corner : [corner.x_m ?? corner.x, corner.y_m ?? corner.y]));
    const xs = points.map((point) => point[0]);
    const ys = points.map((point) => point[1]);
    return { name: one.name ?? "", corners: points, box: { left: Math.min(...xs), right: Math.max(...xs), bottom: Math.min(...ys), top: Math.max(...ys) } };
  }
  const r = one.rectangle ?? one.rectangle_m;
  if (!Array.isArray(r) || r.length !== 4 || !r.every(Number.isFinite)) return null;
  const box = { left: Math.min(r[0], r[2]), right: Math.max(r[0], r[2]), bottom: Math.min(r[1], r[3]), top: Math.max(r[1], r[3]) };
  return { name: one.name ?? "", box, corners: [[box.left, box.bottom], [box.right, box.bottom], [box.right, box.top], [box.left, box.top]] };
}

export function aboutOf(value) {
  const plan = value?.plan ?? {};
  const origin = plan.origin ?? plan.origin_m ?? [];
  const pad = value?.pad ?? plan.pad ?? null;
  const vehicle = value?.vehicle ?? {};
  return {
    name: value?.name ?? "",
    simulated: Boolean(value?.simulated),
    version: value?.version ?? "",
    hash: String(plan.hash ?? ""),
    resolution_m: numberOr(plan.resolution_m, plan.resolution) ?? 0.05,
    origin_x_m: numberOr(plan.origin_x_m, origin[0], origin.x_m, origin.x) ?? 0,
    origin_y_m: numberOr(plan.origin_y_m, origin[1], origin.y_m, origin.y) ?? 0,
    pad: pad ? { x_m: numberOr(pad.x_m, pad.x, pad[0]), y_m: numberOr(pad.y_m, pad.y, pad[1]) } : null,
    rooms: list(value?.rooms ?? plan.rooms, "rooms").map(areaOf).filter(Boolean),
    no_fly: list(value?.no_fly ?? plan.no_fly, "no_fly").map(areaOf).filter(Boolean),
    privacy: list(value?.privacy ?? plan.privacy, "privacy").map(areaOf).filter(Boolean),
    radius_m: numberOr(vehicle.radius_m, vehicle.body?.radius_m) ?? 0.225,
    capacity_mah: numberOr(vehicle.capacity_mah, vehicle.battery?.capacity_mah, vehicle.battery_mah),
    video: list(value?.topics, "topics").some((topic) => (topic.topic ?? topic.name ?? topic) === "camera/video"),
  };
}
