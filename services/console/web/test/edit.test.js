// The editor of the building: its state, order of rooms, undo, what lies under the pointer, scale of a picture.

import assert from "node:assert/strict";
import { test } from "node:test";
import * as b from "../app/pure/building.js";
import { extent, firstReading, growth, grown, making, stateOf } from "../app/pure/drafting.js";
import { History } from "../app/pure/history.js";
import { hit, inside } from "../app/pure/hit.js";

const house = () => b.buildingOf({
  pad: { x: 1, y: 1 },
  doors: [{ name: "Door", a: [5, 2], b: [5, 3] }],
  rooms: ["A", "B", "C", "D"].map((name, k) => ({ name, rectangle: [5 * k, 0, 5 * k + 5, 6] })),
  no_fly: [{ name: "Rack", rectangle: [1, 4, 2, 5] }],
  round: { points: [{ name: "Safe", x: 7, y: 2 }] },
});
const at = (x_m, y_m) => ({ x_m, y_m });

test("whatever comes, a building is whole", () => {
  assert.deepEqual(b.buildingOf(null), { pad: null, doors: [], rooms: [], no_fly: [], privacy: [], round: { order: [], leave_out: [], points: [] } });
  assert.equal(house().pad.heading_deg, 0);
  assert.ok(b.equal(house(), JSON.parse(JSON.stringify(house()))));
});

test("rooms come in the order wished, then by the shortest way, or not at all", () => {
  let now = house();
  assert.deepEqual(b.sections(now), { first: [], rest: ["A", "B", "C", "D"], out: [] });
  now = b.raised(b.raised(now, "C"), "A");
  assert.deepEqual(b.sections(now), { first: ["C", "A"], rest: ["B", "D"], out: [] });
  now = b.raised(now, "A");
  assert.deepEqual(now.round.order, ["A", "C"]);
  assert.equal(b.raised(now, "A"), now, "first already");
  assert.deepEqual(b.lowered(now, "A").round.order, ["C", "A"]);
  assert.deepEqual(b.lowered(now, "C").round.order, ["A"]);
  assert.equal(b.lowered(now, "B"), now);
  const out = b.leftOut(now, "A", true);
  assert.deepEqual(b.sections(out), { first: ["C"], rest: ["B", "D"], out: ["A"] });
  assert.deepEqual(b.sections(b.leftOut(out, "A", false)), { first: ["C"], rest: ["A", "B", "D"], out: [] });
  assert.deepEqual(b.shortest(now).round.order, []);
  assert.deepEqual(house().round.order, [], "nothing is changed in place");
});

test("a room that is renamed or removed is so in the round, too", () => {
  const now = b.leftOut(b.raised(house(), "B"), "C", true);
  const renamed = b.replaced(b.replaced(now, "rooms", 1, { ...now.rooms[1], name: "Bath" }), "rooms", 2, { ...now.rooms[2], name: "Cave" });
  assert.deepEqual([renamed.round.order, renamed.round.leave_out], [["Bath"], ["Cave"]]);
  const gone = b.removed(b.removed(now, "rooms", 2), "rooms", 1);
  assert.deepEqual([gone.round.order, gone.round.leave_out, gone.rooms.length], [[], [], 2]);
  assert.equal(b.removed(now, "points", 0).round.points.length, 0);
});

test("names are bounded in bytes and taken once a kind", () => {
  const now = house();
  assert.equal(b.nameTrouble(now, "rooms", 0, "  "), "empty");
  assert.equal(b.nameTrouble(now, "rooms", 0, "ñ".repeat(16)), "long");
  assert.equal(b.nameTrouble(now, "rooms", 0, "ñ".repeat(15)), null);
  assert.equal(b.nameTrouble(now, "rooms", 0, " B "), "taken");
  assert.equal(b.nameTrouble(now, "rooms", 1, "B"), null);
  assert.equal(b.nameTrouble(now, "points", 9, "B"), null);
  assert.equal(b.freshName(b.added(now, "points", { name: "Point 1", x: 0, y: 0 }), "points", "Point"), "Point 2");
});

test("things are moved and reshaped to the centimetre", () => {
  assert.deepEqual(b.rectangle(at(3.004, 1), at(1, 2.006)).rectangle, [1, 1, 3, 2.01]);
  assert.deepEqual(b.moved({ name: "r", rectangle: [0, 0, 1, 1] }, 0.1, -0.2).rectangle, [0.1, -0.2, 1.1, 0.8]);
  assert.deepEqual(b.moved({ name: "p", x: 1, y: 1 }, 0.5, 0), { name: "p", x: 1.5, y: 1 });
  assert.deepEqual(b.moved({ name: "d", a: [0, 0], b: [1, 0] }, 0, 1), { name: "d", a: [0, 1], b: [1, 1] });
  const room = { name: "r", rectangle: [0, 0, 4, 2] };
  const shaped = b.cornersOf(room).map((_, corner) => b.reshaped(room, corner, 9, 8).rectangle);
  assert.deepEqual(shaped, [[9, 8, 4, 2], [0, 8, 9, 2], [0, 0, 9, 8], [9, 0, 4, 8]]);
  assert.deepEqual(b.reshaped({ name: "z", polygon: [[0, 0], [1, 0], [1, 1]] }, 1, 2, 0.5).polygon, [[0, 0], [2, 0.5], [1, 1]]);
  assert.deepEqual(b.polygon([at(0.123, 0), at(1, 0), at(1, 1)]).polygon[0], [0.12, 0]);
});

test("what changes is said thing by thing", () => {
  const before = house();
  assert.deepEqual(b.changes(before, house()), []);
  let after = b.raised(b.leftOut(before, "D", true), "B");
  after = b.removed(after, "no_fly", 0);
  after = b.added(after, "privacy", { name: "Desk", rectangle: [0, 0, 1, 1] });
  after = b.replaced(after, "points", 0, { name: "Safe", x: 8, y: 2 });
  after = { ...after, pad: { ...after.pad, heading_deg: 90 } };
  const said = b.changes(before, after).map(({ what, kind, name }) => [what, kind, name].filter(Boolean).join(" "));
  assert.deepEqual(said, ["pad", "removed no_fly Rack", "added privacy Desk", "changed points Safe", "left_out rooms D", "order"]);
  assert.deepEqual(b.changes(after, { ...after, round: { ...after.round, order: [], leave_out: [] } }).map((one) => one.what), ["taken_in", "shortest"]);
});

test("a drag is one step back", () => {
  const history = new History(0);
  for (const x of [1, 2, 3]) history.push(x, "drag");
  history.settle();
  for (const x of [4, 5]) history.push(x, "drag");
  history.push(6);
  const back = [];
  while (history.canUndo) {
    history.undo();
    back.push(history.now);
  }
  assert.deepEqual(back, [5, 3, 0]);
  history.redo();
  assert.equal(history.now, 3);
  history.push(9);
  assert.equal(history.canRedo, false);
  for (let k = 0; k < 500; k += 1) history.push(100 + k);
  assert.ok(history.past.length <= 200);
});

test("the smallest thing under the pointer is meant, and corners of what is selected first", () => {
  const now = house();
  assert.deepEqual(hit(now, 7.05, 2, 0.2), { kind: "points", index: 0, corner: null });
  assert.equal(hit(now, 1.1, 1, 0.2).kind, "pad");
  assert.equal(hit(now, 5.05, 2.5, 0.2).kind, "doors");
  assert.deepEqual(hit(now, 1.5, 4.5, 0.2), { kind: "no_fly", index: 0, corner: null });
  assert.deepEqual(hit(now, 3, 3, 0.2), { kind: "rooms", index: 0, corner: null });
  assert.equal(hit(now, 3, 3, 0.2, null, ["no_fly"]), null);
  assert.equal(hit(now, 30, 3, 0.2), null);
  assert.deepEqual(hit(now, 2.1, 5.1, 0.2, { kind: "no_fly", index: 0 }), { kind: "no_fly", index: 0, corner: 2 });
  assert.deepEqual(hit(now, 5, 3.1, 0.2, { kind: "doors", index: 0 }), { kind: "doors", index: 0, corner: 1 });
  assert.ok(inside([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], 1, 1) && !inside([[0, 0], [4, 0], [4, 4], [2, 1], [0, 4]], 2, 3));
});

test("two points and their distance give the scale, and what is drawn stays on the picture", () => {
  const first = { building: house(), reading: firstReading(1500, 900) };
  assert.equal(first.reading.metres_per_pixel, 0.02);
  assert.deepEqual(extent({ width: 1500, height: 900 }, first.reading), { left: 0, bottom: 0, right: 30, top: 18 });
  const ratio = growth(first.reading, at(5, 2), at(5, 3), 0.9);
  assert.ok(Math.abs(ratio - 0.9) < 1e-12);
  const next = grown({ ...first, reading: { ...first.reading, walls: [[0, 0, 10, 0]] } }, ratio);
  assert.ok(Math.abs(next.reading.metres_per_pixel - 0.018) < 1e-12 && next.reading.measured);
  assert.deepEqual(next.building.doors[0], { name: "Door", a: [4.5, 1.8], b: [4.5, 2.7] });
  assert.deepEqual(next.building.rooms[1].rectangle, [4.5, 0, 9, 5.4]);
  assert.deepEqual([next.building.pad.x, next.building.round.points[0].x, next.reading.walls], [0.9, 6.3, [[0, 0, 9, 0]]]);
  for (const metres of [0, -1, NaN, Infinity, 1e6]) assert.equal(growth(first.reading, at(5, 2), at(5, 3), metres), null);
  assert.equal(growth(first.reading, at(5, 2), at(5, 2), 1), null);
  assert.deepEqual(Object.keys(making(next)).sort(), ["building", "dark_below", "metres_per_pixel", "origin", "walls", "wiped"]);
});

test("a draft is taken up where it was left", () => {
  const draft = { id: "x", width: 100, height: 50 };
  assert.equal(stateOf({ draft, plan: null }, house()).reading.measured, false);
  const plan = { reading: { metres_per_pixel: 0.01, origin: [0, 0], dark_below: 90, walls: [], wiped: [] }, building: house() };
  const state = stateOf({ draft, plan }, b.buildingOf(null));
  assert.deepEqual([state.reading.dark_below, state.reading.measured, state.building.rooms.length], [90, true, 4]);
});
