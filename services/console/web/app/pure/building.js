// The building as it is edited: rooms, doors, zones, points, the order of the round. Every change gives a new building, so that
// undoing is keeping the old one. The form is the drone's own (docs/off-board.md), metres on the plan.

import { list } from "./lists.js";

/** Most of each kind, as the drone allows. */
export const MOST = { rooms: 48, doors: 256, no_fly: 64, privacy: 64, points: 32 };
export const KINDS = Object.keys(MOST);
/** Kinds with an outline. */
export const AREAS = ["rooms", "no_fly", "privacy"];
/** Bytes of a name. */
export const NAME_BYTES = 31;
const MOST_CORNERS = 256;

/** To the centimetre. */
export function cm(metres) {
  return Math.round(metres * 100) / 100 + 0;
}

/** A whole building of whatever came; what is missing is empty. */
export function buildingOf(value) {
  const round = value?.round ?? {};
  return {
    pad: value?.pad ? { x: value.pad.x, y: value.pad.y, heading_deg: value.pad.heading_deg ?? 0 } : null,
    doors: list(value?.doors), rooms: list(value?.rooms), no_fly: list(value?.no_fly), privacy: list(value?.privacy),
    round: { order: list(round.order), leave_out: list(round.leave_out), points: list(round.points) },
  };
}

export function itemsOf(building, kind) {
  return kind === "points" ? building.round.points : building[kind];
}

function withItems(building, kind, items) {
  if (kind === "points") return { ...building, round: { ...building.round, points: items } };
  return { ...building, [kind]: items };
}

export function added(building, kind, item) {
  return withItems(building, kind, [...itemsOf(building, kind), item]);
}

export function replaced(building, kind, index, item) {
  const items = itemsOf(building, kind);
  const before = items[index].name;
  const next = withItems(building, kind, items.map((one, k) => (k === index ? item : one)));
  if (kind !== "rooms" || before === item.name) return next;
  // The round speaks of rooms by their names.
  const renamed = (names) => names.map((name) => (name === before ? item.name : name));
  return { ...next, round: { ...next.round, order: renamed(next.round.order), leave_out: renamed(next.round.leave_out) } };
}

export function removed(building, kind, index) {
  const items = itemsOf(building, kind);
  const gone = items[index].name;
  const next = withItems(building, kind, items.filter((_, k) => k !== index));
  if (kind !== "rooms") return next;
  const without = (names) => names.filter((name) => name !== gone);
  return { ...next, round: { ...next.round, order: without(next.round.order), leave_out: without(next.round.leave_out) } };
}

/** The first of `base 1`, `base 2` ... that none of this kind has. */
export function freshName(building, kind, base) {
  const taken = new Set(itemsOf(building, kind).map((item) => item.name));
  let number = 1;
  while (taken.has(`${base} ${number}`)) number += 1;
  return `${base} ${number}`;
}

/** What is wrong with a name: "empty", "long", "taken", or null. */
export function nameTrouble(building, kind, index, name) {
  const plain = name.trim();
  if (plain === "") return "empty";
  if (new TextEncoder().encode(plain).length > NAME_BYTES) return "long";
  if (kind !== "doors" && itemsOf(building, kind).some((item, k) => k !== index && item.name === plain)) return "taken";
  return null;
}

export function cornersOf(area) {
  if (area.polygon) return area.polygon;
  const [ax, ay, bx, by] = area.rectangle;
  return [[ax, ay], [bx, ay], [bx, by], [ax, by]];
}

export function rectangle(a, b) {
  return { rectangle: [cm(Math.min(a.x_m, b.x_m)), cm(Math.min(a.y_m, b.y_m)), cm(Math.max(a.x_m, b.x_m)), cm(Math.max(a.y_m, b.y_m))] };
}

export function polygon(corners) {
  return { polygon: corners.slice(0, MOST_CORNERS).map(({ x_m, y_m }) => [cm(x_m), cm(y_m)]) };
}

/** An item of any kind, carried by (dx, dy). */
export function moved(item, dx, dy) {
  const at = ([x, y]) => [cm(x + dx), cm(y + dy)];
  if (item.rectangle) return { ...item, rectangle: [...at(item.rectangle.slice(0, 2)), ...at(item.rectangle.slice(2))] };
  if (item.polygon) return { ...item, polygon: item.polygon.map(at) };
  if (item.a) return { ...item, a: at(item.a), b: at(item.b) };
  return { ...item, x: cm(item.x + dx), y: cm(item.y + dy) };
}

/** An area or door with one of its corners elsewhere. A rectangle keeps the corner across. */
export function reshaped(item, corner, x, y) {
  if (item.polygon) return { ...item, polygon: item.polygon.map((one, k) => (k === corner ? [cm(x), cm(y)] : one)) };
  if (item.a) return { ...item, [corner === 0 ? "a" : "b"]: [cm(x), cm(y)] };
  const across = cornersOf(item)[(corner + 2) % 4];
  return { ...item, rectangle: [...(corner === 0 || corner === 3 ? [cm(x)] : [across[0]]), ...(corner < 2 ? [cm(y)] : [across[1]]),
    ...(corner === 0 || corner === 3 ? [across[0]] : [cm(x)]), ...(corner < 2 ? [across[1]] : [cm(y)])] };
}

/** Rooms by how they are visited: in the order wished, then as is shortest, and not at all. */
export function sections(building) {
  const { order, leave_out } = building.round;
  const rest = building.rooms.map((room) => room.name).filter((name) => !order.includes(name) && !leave_out.includes(name));
  return { first: order, rest, out: leave_out };
}

function withRound(building, change) {
  return { ...building, round: { ...building.round, ...change } };
}

/** A room comes one place sooner; one that came by the shortest way comes last of those in order. */
export function raised(building, name) {
  const { order } = building.round;
  const at = order.indexOf(name);
  if (at < 0) return withRound(building, { order: [...order, name] });
  if (at === 0) return building;
  const next = [...order];
  next.splice(at - 1, 2, name, order[at - 1]);
  return withRound(building, { order: next });
}

/** A room comes one place later; the last of those in order comes by the shortest way again. */
export function lowered(building, name) {
  const { order } = building.round;
  const at = order.indexOf(name);
  if (at < 0) return building;
  if (at === order.length - 1) return withRound(building, { order: order.slice(0, -1) });
  const next = [...order];
  next.splice(at, 2, order[at + 1], name);
  return withRound(building, { order: next });
}

export function leftOut(building, name, out) {
  const { order, leave_out } = building.round;
  const others = leave_out.filter((one) => one !== name);
  if (!out) return withRound(building, { leave_out: others });
  return withRound(building, { order: order.filter((one) => one !== name), leave_out: [...others, name] });
}

export function shortest(building) {
  return withRound(building, { order: [] });
}

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/** Whether two buildings say the same. */
export function equal(a, b) {
  return same(buildingOf(a), buildingOf(b));
}

/** What differs, as [{what, kind, name}]: for whoever is about to fly by it. */
export function changes(before, after) {
  const found = [];
  if (!same(before.pad, after.pad)) found.push({ what: "pad", kind: "", name: "" });
  for (const kind of KINDS) {
    const old = new Map(itemsOf(before, kind).map((item) => [item.name, item]));
    const now = new Map(itemsOf(after, kind).map((item) => [item.name, item]));
    for (const [name, item] of now) {
      if (!old.has(name)) found.push({ what: "added", kind, name });
      else if (!same(old.get(name), item)) found.push({ what: "changed", kind, name });
    }
    for (const name of old.keys()) if (!now.has(name)) found.push({ what: "removed", kind, name });
  }
  const rooms = (building) => new Set(building.rooms.map((room) => room.name));
  const [had, has] = [rooms(before), rooms(after)];
  for (const name of after.round.leave_out) if (!before.round.leave_out.includes(name)) found.push({ what: "left_out", kind: "rooms", name });
  for (const name of before.round.leave_out) if (!after.round.leave_out.includes(name) && has.has(name)) found.push({ what: "taken_in", kind: "rooms", name });
  if (!same(before.round.order, after.round.order) && [...had].some((name) => has.has(name))) found.push({ what: after.round.order.length > 0 ? "order" : "shortest", kind: "", name: "" });
  return found;
}
