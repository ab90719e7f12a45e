// What is shown: ages, trust, battery, bytes, clusters, projection, orders, alarms, events.

import assert from "node:assert/strict";
import { test } from "node:test";
import { aboutOf } from "../app/pure/about.js";
import { News, STALE_MS, ageParts, clock, freshness } from "../app/pure/age.js";
import { Alarms } from "../app/pure/alarms.js";
import { MeanCurrent, battery, shareByVoltage } from "../app/pure/battery.js";
import { GRID_SIDE, grid, particles, splitBinary } from "../app/pure/binary.js";
import { parse } from "../app/pure/bits.js";
import { Chronicle } from "../app/pure/chronicle.js";
import { clusters } from "../app/pure/clusters.js";
import { causesIn } from "../app/pure/codes.js";
import { Hold } from "../app/pure/hold.js";
import { offers } from "../app/pure/offers.js";
import { Projection, scaleBar } from "../app/pure/projection.js";
import { outcomeOf, reportOf } from "../app/pure/report.js";
import { progress, roomAt } from "../app/pure/rooms.js";
import { Trail } from "../app/pure/trail.js";
import { ellipse, lengthParts, trust } from "../app/pure/trust.js";
import { rectangles } from "../app/pure/walls.js";

const pose = (more = {}) => ({ x_m: 2, y_m: 3, heading_rad: 0, variance_x_m2: 0.0016, covariance_xy_m2: 0, variance_y_m2: 0.0004, p_lost: 0.01, state: 2, searching: 0, ...more });
const pilot = (more = {}) => ({ header: { stamp_ns: 10e9 }, phase: 4, cause: 0, action: 0, causes: 0, automatic: 1, holder: "", sticks: 0, ...more });

test("ages: fresh, late, stale, never", () => {
  assert.deepEqual([null, 0, 999, 1000, STALE_MS].map((age) => freshness(age === null ? null : 5000 - age, 5000)), ["none", "live", "live", "late", "stale"]);
  assert.deepEqual(ageParts(340), { key: "s", value: "0.3" });
  assert.deepEqual(ageParts(-5), { key: "s", value: "0.0" });
  assert.deepEqual(ageParts(42_900), { key: "s", value: "42" });
  assert.deepEqual(ageParts(125_000), { key: "min", value: "2" });
  assert.deepEqual(ageParts(7.3e6), { key: "h", value: "2" });
  assert.equal(clock(187), "3:07");
  const news = new News();
  assert.equal(news.whole(0), "none");
  news.heard("a", 100);
  assert.equal(news.whole(200), "live");
  assert.equal(news.freshness("b", 200), "none");
  assert.equal(news.freshness("a", 100 + STALE_MS), "stale");
});

test("how sure: two standard deviations of the worse direction", () => {
  const turned = ellipse({ variance_x_m2: 0.01, variance_y_m2: 0.01, covariance_xy_m2: 0.0075 });
  assert.ok(Math.abs(turned.major_m - Math.sqrt(0.0175)) < 1e-9 && Math.abs(turned.direction_rad - Math.PI / 4) < 1e-9);
  assert.deepEqual(trust(pose()), { level: "sure", key: "trust.sure", within: { value: "8", unit: "cm" } });
  assert.equal(trust(pose({ variance_x_m2: 0.09 })).level, "fair");
  assert.equal(trust(pose({ variance_x_m2: 0.3 })).key, "trust.wide");
  assert.equal(trust(pose({ p_lost: 0.2 })).key, "trust.unsure");
  assert.deepEqual(trust(pose({ state: 1 }), 2), { level: "unsure", key: "trust.between", within: { value: "2", unit: "" } });
  assert.equal(trust(pose({ state: 0 }), 3).key, "trust.lost_places");
  assert.equal(trust(pose({ searching: 1 }), 5).level, "searching");
  assert.equal(trust(null).level, "lost");
  assert.deepEqual([0.004, 0.11, 0.42, 1.26].map((m) => Object.values(lengthParts(m)).join(" ")), ["1 cm", "11 cm", "40 cm", "1.3 m"]);
});

test("battery: minutes from charge and mean current, voltage at rest", () => {
  const mean = new MeanCurrent();
  mean.add(0.4, 0);
  assert.equal(mean.value, null, "motors off");
  for (let now = 0; now < 60_000; now += 500) mean.add(now % 1000 ? 8 : 10, now);
  assert.ok(Math.abs(mean.value - 9) < 0.3, `${mean.value}`);
  const { minutes, share } = battery({ volts: 16, cells: 4, drawn_mah: 1850 }, 3700, 9);
  assert.equal(share, 0.5);
  assert.ok(Math.abs(minutes - (0.4 * 3.7 * 60) / 9) < 1e-9);
  assert.equal(battery({ volts: 16.8, cells: 4, drawn_mah: null }, 3700, null).share, 1);
  assert.equal(battery({ volts: null, cells: 0, drawn_mah: null }, null, null).share, null);
  assert.equal(battery(null, 3700, 9).minutes, null);
  assert.equal(battery({ volts: 14, cells: 4, drawn_mah: 9999 }, 3700, 9).minutes, 0);
  assert.ok(shareByVoltage(3.7) < shareByVoltage(3.9));
});

function particlesMessage(room, places) {
  const body = new ArrayBuffer(144 + 32 * room);
  const view = new DataView(body);
  view.setUint32(136, places.length, true);
  places.forEach(([x, y, weight], k) => {
    view.setFloat32(144 + 4 * k, x, true);
    view.setFloat32(144 + 4 * (room + k), y, true);
    view.setFloat32(144 + 4 * (7 * room + k), weight, true);
  });
  return body;
}

test("particles: whole columns and cut ones are the same set; broken ones are none", () => {
  const places = [[1, 2, 0.25], [3, 4, 0.75]];
  for (const room of [2, 50]) {
    const set = particles(new DataView(particlesMessage(room, places)));
    assert.equal(set.count, 2);
    assert.deepEqual([...set.x_m, ...set.y_m, ...set.weight], [1, 3, 2, 4, 0.25, 0.75]);
  }
  assert.equal(particles(new DataView(new ArrayBuffer(100))), null);
  assert.equal(particles(new DataView(new ArrayBuffer(145))), null);
  const lying = particlesMessage(1, [[1, 2, 1]]);
  new DataView(lying).setUint32(136, 4_000_000, true);
  assert.equal(particles(new DataView(lying)).count, 1);
});

test("binary messages carry their topic in front", () => {
  const name = new TextEncoder().encode("navigation/grid");
  const bytes = new Uint8Array(1 + name.length + 47 + GRID_SIDE ** 2);
  bytes[0] = name.length;
  bytes.set(name, 1);
  const view = new DataView(bytes.buffer, 1 + name.length);
  view.setFloat32(24, -1.5, true);
  view.setFloat32(32, 0.05, true);
  view.setUint8(47 + 82, 9);
  const split = splitBinary(bytes.buffer);
  assert.equal(split.topic, "navigation/grid");
  const read = grid(split.bytes);
  assert.equal(read.origin_x_m, -1.5);
  assert.equal(read.cells[82], 9);
  assert.equal(splitBinary(new ArrayBuffer(1)), null);
  assert.equal(splitBinary(new Uint8Array([200, 1, 2]).buffer), null);
  assert.equal(grid(new DataView(new ArrayBuffer(50))), null);
});

test("bitmaps of 64-bit words keep every bit", () => {
  const { data } = parse('{"topic":"navigation/patrol","data":{"seen":[18446744073709551615,9223372036854775809],"unmapped":[],"text":"x"}}');
  assert.deepEqual([...data.seen], [255, 255, 255, 255, 255, 255, 255, 255, 1, 0, 0, 0, 0, 0, 0, 128]);
  assert.equal(data.unmapped.length, 0);
  assert.equal(data.text, "x");
  assert.deepEqual(parse('{"alive":true}'), { alive: true });
  assert.throws(() => parse("{"));
});

test("competing places: two heaps are two places with their shares, dust is none", () => {
  const set = { count: 0, x_m: [], y_m: [], weight: [] };
  const add = (x, y, weight) => {
    set.x_m.push(x);
    set.y_m.push(y);
    set.weight.push(weight);
    set.count += 1;
  };
  for (let k = 0; k < 70; k += 1) add(2 + 0.01 * k, 3, 0.01);
  for (let k = 0; k < 29; k += 1) add(10, 7 + 0.02 * k, 0.01);
  add(30, 30, 0.01);
  add(NaN, 1, 0.5);
  const found = clusters(set);
  assert.equal(found.length, 2);
  assert.ok(Math.abs(found[0].share - 0.7) < 1e-9 && Math.abs(found[0].x_m - 2.345) < 1e-6);
  assert.ok(Math.abs(found[1].share - 0.29) < 1e-9);
  assert.deepEqual(clusters({ count: 0, x_m: [], y_m: [], weight: [] }), []);
});

test("the projection leads back, zooms about the pointer and fits with its margins", () => {
  const p = new Projection();
  p.resize(800, 600);
  p.fit({ left: 0, bottom: 0, right: 20, top: 10 }, { top: 100, right: 0, bottom: 0, left: 0 });
  assert.equal(p.scale, 40);
  assert.ok(Math.abs(p.y(10) - 150) < 1e-9 && Math.abs(p.x(0)) < 1e-9);
  const at = p.place(123, 456);
  assert.ok(Math.abs(p.x(at.x_m) - 123) < 1e-9 && Math.abs(p.y(at.y_m) - 456) < 1e-9);
  p.zoom(1.7, 123, 456);
  assert.ok(Math.abs(p.x(at.x_m) - 123) < 1e-6 && Math.abs(p.y(at.y_m) - 456) < 1e-6);
  p.pan(10, 5);
  assert.ok(Math.abs(p.x(at.x_m) - 133) < 1e-6 && Math.abs(p.y(at.y_m) - 461) < 1e-6);
  assert.deepEqual([10, 40, 200].map((scale) => scaleBar(scale, 110)), [10, 2, 0.5]);
});

test("walls are covered exactly, by few rectangles", () => {
  const rows = ["#####", "#..##", "#..##", "#####"];
  const width = 5;
  const is = (index) => rows[Math.floor(index / width)][index % width] === "#";
  const found = rectangles(width, rows.length, is);
  const covered = new Array(20).fill(0);
  for (const [x, y, w, h] of found) for (let row = y; row < y + h; row += 1) for (let column = x; column < x + w; column += 1) covered[row * width + column] += 1;
  assert.deepEqual(covered, Array.from({ length: 20 }, (_, k) => (is(k) ? 1 : 0)));
  assert.equal(found.length, 4);
});

test("rooms: the smallest around a place, and none outside", () => {
  const about = aboutOf({ rooms: [{ name: "Hall", rectangle: [0, 0, 10, 10] }, { name: "Booth", rectangle: [4, 4, 6, 6] }, { name: "L", polygon: [[20, 0], [30, 0], [30, 10], [25, 10], [25, 5], [20, 5]] }, { name: "nowhere" }], plan: { resolution: 0.05, origin: [-1, -2, 0] } });
  assert.equal(about.rooms.length, 3);
  assert.equal(about.origin_y_m, -2);
  assert.deepEqual([[5, 5], [1, 1], [21, 8], [27, 8], [50, 50]].map(([x, y]) => roomAt(about.rooms, x, y)), ["Booth", "Hall", null, "L", null]);
  assert.deepEqual(progress({ rooms: [{ state: 2 }, { state: 1 }, { state: 3 }, { state: 2 }], rooms_used: 3 }), { done: 2, all: 3 });
});

test("orders that make sense: the round's button changes its word, land needs a flight", () => {
  assert.equal(offers(pilot({ phase: 0 }), { state: 0 }).primary.key, "order.start");
  assert.equal(offers(pilot(), { state: 2 }).primary.verb, "patrol-pause");
  assert.equal(offers(pilot({ phase: 3 }), { state: 3 }).primary.key, "order.resume");
  const ground = offers(pilot({ phase: 0 }), { state: 6 });
  assert.ok(!ground.land && !ground.home && !ground.goto && ground.takeoff && !ground.cut);
  assert.ok(offers(null, null).cut && offers(null, null).land, "without news nothing is kept away");
  assert.equal(offers(pilot({ phase: 7 }), { state: 2 }).primaryReady, false);
});

test("a held button fires once, and only when held long enough", () => {
  const hold = new Hold(1000);
  hold.press(0);
  assert.equal(hold.look(999), false);
  assert.equal(hold.progress(500), 0.5);
  hold.release();
  assert.equal(hold.look(2000), false);
  hold.press(3000);
  hold.press(3900);
  assert.equal(hold.look(4000), true);
  assert.equal(hold.look(4001), false);
});

test("alarms sound until acknowledged, again when they come again", () => {
  const alarms = new Alarms();
  const patrol = { pad_x_m: 2, pad_y_m: 3 };
  alarms.look(pilot(), pose(), patrol);
  assert.equal(alarms.sounding, false);
  const failing = pilot({ cause: 4, action: 1 });
  alarms.look(failing, pose(), patrol);
  assert.equal(alarms.sounding, true);
  alarms.acknowledge();
  alarms.look(failing, pose(), patrol);
  assert.equal(alarms.sounding, false);
  assert.equal(alarms.active.length, 1);
  alarms.look(pilot({ cause: 4, action: 4 }), pose(), patrol);
  assert.equal(alarms.sounding, true, "it does something worse now");
  alarms.look(pilot(), pose(), patrol);
  alarms.look(failing, pose(), patrol);
  assert.equal(alarms.sounding, true, "it came again");
});

test("landed elsewhere is an alarm, landed on the pad is none, a closed side sonar is none", () => {
  const patrol = { pad_x_m: 2, pad_y_m: 3 };
  for (const [x_m, expected] of [[2.3, 0], [5, 1]]) {
    const alarms = new Alarms();
    alarms.look(pilot({ phase: 6 }), pose(), patrol);
    alarms.look(pilot({ phase: 0 }), pose({ x_m }), patrol);
    assert.equal(alarms.active.length, expected);
    alarms.acknowledge();
    alarms.look(pilot({ phase: 0 }), pose({ x_m }), patrol);
    assert.equal(alarms.active.length, 0);
  }
  const alarms = new Alarms();
  alarms.look(pilot({ cause: 3, action: 0 }), pose(), patrol);
  assert.equal(alarms.active.length, 0);
  alarms.look(pilot({ cause: 12, action: 3 }), pose(), patrol);
  assert.equal(alarms.active.length, 0, "an order to land is no failsafe");
  const first = new Alarms();
  first.look(pilot({ phase: 0 }), pose({ x_m: 9 }), patrol);
  assert.equal(first.active.length, 0, "who comes late is not alarmed by a drone that stands");
  assert.deepEqual(causesIn((1 << 6) | (1 << 4)), [6, 4]);
});

test("the event log tells what changed, not what was", () => {
  const chronicle = new Chronicle();
  const patrol = (state, rooms) => ({ state, rooms, rooms_used: rooms.length });
  const room = (state, reason = "") => ({ name: "Store", state, seen: 0, reason });
  chronicle.look(pilot({ phase: 4 }), patrol(2, [room(2)]), pose(), 1);
  assert.equal(chronicle.entries.length, 0);
  chronicle.look(pilot({ phase: 5, holder: "ana" }), patrol(3, [room(3, "door closed")]), pose(), 2);
  assert.deepEqual(chronicle.entries.map((entry) => entry.key), ["event.room_skipped", "round.paused", "event.holder", "phase.manual"]);
  chronicle.look(pilot({ phase: 5, holder: "ana" }), patrol(3, [room(3, "door closed")]), pose(), 3);
  assert.equal(chronicle.entries.length, 4);
  chronicle.look(pilot({ phase: 7, cause: 8, action: 4, holder: "" }), patrol(3, [room(3)]), pose(), 4);
  assert.deepEqual(chronicle.entries.slice(0, 3).map((entry) => entry.key), ["event.no_holder", "event.failsafe", "phase.emergency"]);
  const before = chronicle.entries.length;
  chronicle.ordered("home", { outcome: "refused", text: "refused: not flying" }, 5);
  assert.equal(chronicle.entries.length, before, "the console tells it");
  chronicle.ordered("home", { outcome: "unsent", text: "" }, 5);
  assert.equal(chronicle.entries[0].key, "event.order_unsent");
  chronicle.told({ time_ms: 77, kind: "order", text: "refused: not flying", account: "ana", verb: "home", accepted: false }, 6);
  assert.deepEqual([chronicle.entries[0].key, chronicle.entries[0].at, chronicle.entries[0].values.verb.key], ["event.order_refused", 77, "verb.home"]);
  for (const line of [null, "x", { kind: "phase", text: "hover" }, { kind: "failsafe", text: "lost" }]) chronicle.told(line, 7);
  assert.equal(chronicle.entries[0].at, 77);
  chronicle.told({ time_ms: 78, kind: "round", text: "over", report: 12 }, 8);
  assert.equal(chronicle.entries[0].values.report, 12);
  assert.equal(chronicle.report, 12);
  for (let k = 0; k < 1000; k += 1) chronicle.told({ kind: "link", text: "x" }, k);
  assert.equal(chronicle.entries.length, 300);
});

test("what was before is told as the console tells it: a failsafe has an end, and one that flickers is one line", () => {
  const chronicle = new Chronicle(10_000);
  const told = (time_ms, text, verb) => chronicle.told({ time_ms, kind: "failsafe", text, verb }, time_ms);
  told(100, "operator silent", "hover");
  told(300, "none", "none");
  told(600, "operator silent", "hover");
  told(700, "none", "none");
  told(800, "a side sonar is silent", "none");
  told(900, "none", "none");
  told(9000, "operator silent", "hover");
  assert.deepEqual(chronicle.entries.map((entry) => [entry.at, entry.key]), [[9000, "event.failsafe"], [700, "event.failsafe_over"], [100, "event.failsafe"]]);
});

test("a failsafe that flickers is one line; one that comes again later is another", () => {
  const chronicle = new Chronicle();
  chronicle.look(pilot(), null, null, 0);
  for (let at = 1000; at < 9000; at += 400) {
    chronicle.look(pilot({ cause: 2, action: 1 }), null, null, at);
    chronicle.look(pilot(), null, null, at + 200);
  }
  assert.deepEqual(chronicle.entries.map((entry) => entry.key), ["event.failsafe_over", "event.failsafe"]);
  chronicle.look(pilot({ cause: 2, action: 1 }), null, null, 60_000);
  assert.equal(chronicle.entries.length, 3);
});

test("what the console tells of before stands in its place, once, and is no news", () => {
  const chronicle = new Chronicle(1000);
  chronicle.look(pilot({ phase: 0 }), null, null, 1000);
  chronicle.look(pilot({ phase: 2 }), null, null, 1500);
  const history = [
    { time_ms: 100, kind: "phase", text: "take-off" }, { time_ms: 200, kind: "failsafe", text: "position uncertain", verb: "hover" }, { time_ms: 300, kind: "failsafe", text: "none" },
    { time_ms: 400, kind: "round", text: "landed_on_pad", report: 7 }, { time_ms: 500, kind: "failsafe", text: "a side sonar is silent", verb: "none" }, { time_ms: 600, kind: "failsafe", text: "none" },
    { time_ms: 1400, kind: "phase", text: "take-off" },
  ];
  for (let k = 0; k < 3; k += 1) for (const line of history) chronicle.told(line, 2000);
  assert.deepEqual(chronicle.entries.map((entry) => [entry.at, entry.key]), [[1500, "phase.takeoff"], [400, "event.report"], [300, "event.failsafe_over"], [200, "event.failsafe"], [100, "phase.takeoff"]]);
  assert.equal(chronicle.report, null);
});

test("the path begins with the flight, breaks where the place was not known, and is bounded", () => {
  const trail = new Trail();
  trail.add(pose(), pilot({ phase: 0 }));
  assert.equal(trail.points.length, 0);
  for (let k = 0; k < 100; k += 1) trail.add(pose({ x_m: 0.01 * k }), pilot());
  assert.ok(trail.points.length > 15 && trail.points.length < 25);
  trail.add(pose({ x_m: 9 }), pilot());
  assert.equal(trail.points.at(-1).gap, true);
  trail.add(pose({ state: 0 }), pilot());
  trail.add(pose({ x_m: 9.1 }), pilot());
  assert.equal(trail.points.at(-1).gap, true);
  for (let k = 0; k < 20_000; k += 1) trail.add(pose({ x_m: 0.1 * k }), pilot());
  assert.ok(trail.points.length <= 8000);
  trail.add(pose(), pilot({ phase: 0 }));
  trail.add(pose(), pilot());
  assert.equal(trail.points.length, 1);
});

test("reports: whatever is absent is filled in", () => {
  const report = reportOf({ id: 1, drone: "d", started_ms: 1, landed_ms: 2, outcome: "landed_on_pad", coverage: 0.9, rooms: [{ name: "Hall", state: "partly seen", seen: 1.7 }, { name: "Store", state: 3 }], flown_by: [{ time_ms: 5, text: "ana" }] });
  assert.deepEqual(report.flown_by, [{ time_ms: 5, ended_ms: null, text: "ana", action: "" }]);
  assert.deepEqual(report.rooms.map((room) => [room.state, room.seen]), [["partly", 1], ["skipped", 0]]);
  assert.deepEqual(report.incidents, []);
  assert.equal(outcomeOf("landed on pad").tone, "good");
  assert.equal(outcomeOf("something else").key, null);
  assert.deepEqual(reportOf(null).rooms, []);
});
