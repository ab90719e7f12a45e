// Mapping, dead band, wizard, liveness, frames, keys.

import assert from "node:assert/strict";
import { test } from "node:test";
import { HELD_MS, IDLE_MS, LEAST_MS, Pace, frame, join } from "../app/pure/frame.js";
import { KEY_SHARE, flies, wishOf } from "../app/pure/keys.js";
import { BEACON_MS, Liveness, SILENT_MS } from "../app/pure/liveness.js";
import { apply, deadBand, defaultMapping, fits, recognise } from "../app/pure/mapping.js";
import { STEPS, Wizard } from "../app/pure/wizard.js";

const button = (pressed) => ({ pressed, value: pressed ? 1 : 0 });
const radio = (axes, buttons = []) => ({ id: "OpenTX Taranis Joystick", mapping: "", axes, buttons: buttons.map(button) });
const gamepad = (axes, pressed = []) => ({ id: "Pad", mapping: "standard", axes, buttons: Array.from({ length: 17 }, (_, k) => button(pressed.includes(k))) });

test("the dead band is silent inside, begins at zero and ends at one", () => {
  assert.equal(deadBand(0.08, 0.08), 0);
  assert.equal(deadBand(-0.05, 0.08), 0);
  assert.ok(deadBand(0.0801, 0.08) < 0.001);
  assert.equal(deadBand(1, 0.08), 1);
  assert.equal(deadBand(-1.2, 0.08), -1);
  assert.equal(deadBand(NaN, 0.08), 0);
  for (let v = -1; v < 1; v += 0.01) assert.ok(deadBand(v + 0.01, 0.1) >= deadBand(v, 0.1));
});

test("a transmitter is flown in the thesis's order: throttle, aileron, elevator, rudder, arm", () => {
  const device = radio([0.5, 1, -1, 0, 1, 0]);
  assert.deepEqual(recognise(device), { kind: "radio" });
  const mapping = defaultMapping(device);
  assert.ok(fits(mapping, device));
  const wish = apply(device, mapping, 0);
  assert.deepEqual(wish, { forward: -1, left: -1, up: 0.5, turn: 0, held: null, arm: "on" });
  assert.equal(apply(radio([0, 0, 0, 0, -1, 0]), mapping, 0).arm, "off");
  assert.equal(apply(radio([0, 0, 0, 0]), defaultMapping(radio([0, 0, 0, 0])), 0).arm, "absent");
});

test("a standard gamepad: left stick climbs and turns, right stick moves, right bumper holds", () => {
  const device = gamepad([1, -1, 0, -0.5], [5]);
  const wish = apply(device, defaultMapping(device), 0);
  assert.deepEqual(wish, { forward: 0.5, left: 0, up: 1, turn: -1, held: true, arm: "absent" });
});

test("too few axes are named and refused", () => {
  assert.deepEqual(recognise(radio([0, 0])), { error: "few_axes", have: 2, need: 4 });
  assert.equal(defaultMapping(radio([0, 0, 0])), null);
});

test("a mapping that does not fit the device is not used", () => {
  const device = radio([0, 0, 0, 0, 0], [false]);
  const good = defaultMapping(device);
  assert.ok(fits(good, device));
  for (const bad of [null, 7, {}, { ...good, rudder: null }, { ...good, rudder: { axis: 9, sign: 1 } }, { ...good, rudder: { axis: 0, sign: 1 } },
    { ...good, rudder: { button: 0 } }, { ...good, rudder: { axis: 3, sign: 2 } }, { ...good, hold: { button: 4 } }, { ...good, hold: {} }]) {
    assert.equal(fits(bad, device), false, JSON.stringify(bad));
  }
});

test("the wizard learns axes, signs, an arm switch and a button, whatever their order", () => {
  const wizard = new Wizard();
  let now = 0;
  const rest = [0.02, 0, -1, 0, -1, 0.1];
  const feed = (axes, pressed = false, steps = 30) => {
    for (let k = 0; k < steps; k += 1) wizard.sample(radio(axes, [pressed]), (now += 20));
  };
  const move = (axis, value) => feed(rest.map((old, k) => (k === axis ? value : old)), false, 3);
  feed(rest);
  assert.equal(wizard.phase, "move");
  for (const [step, axis, value] of [["throttle", 2, 1], ["aileron", 0, -1], ["elevator", 3, 0.9], ["rudder", 5, -0.95], ["arm", 4, 1]]) {
    assert.equal(wizard.step, step);
    move(axis, value);
    feed(rest);
  }
  assert.equal(wizard.step, "hold");
  feed(rest, true, 3);
  assert.ok(wizard.done);
  assert.deepEqual(wizard.mapping, {
    throttle: { axis: 2, sign: 1 }, aileron: { axis: 0, sign: -1 }, elevator: { axis: 3, sign: 1 }, rudder: { axis: 5, sign: -1 }, arm: { axis: 4, sign: 1 }, hold: { button: 0 },
  });
  assert.ok(fits(wizard.mapping, radio(rest, [false])));
});

test("the wizard takes no axis twice, no small move, and skips only what may be skipped", () => {
  const wizard = new Wizard();
  let now = 0;
  const feed = (axes, steps = 30) => {
    for (let k = 0; k < steps; k += 1) wizard.sample(radio(axes), (now += 20));
  };
  feed([0, 0, 0, 0]);
  wizard.skip();
  assert.equal(wizard.step, "throttle");
  feed([0.5, 0, 0, 0], 3);
  assert.equal(wizard.step, "throttle");
  feed([1, 0, 0, 0], 3);
  assert.equal(wizard.step, "aileron");
  // The stick goes back: that is no step, and the same axis again is none either.
  feed([0, 0, 0, 0]);
  feed([1, 0, 0, 0], 30);
  assert.equal(wizard.step, "aileron");
  for (const axis of [1, 2, 3]) {
    feed([0, 0, 0, 0]);
    feed([0, 1, 2, 3].map((k) => (k === axis ? 1 : 0)), 3);
  }
  assert.equal(wizard.step, "arm");
  wizard.skip();
  wizard.skip();
  assert.ok(wizard.done && wizard.mapping.arm === null && wizard.mapping.hold === null);
  assert.equal(STEPS.length, 6);
});

test("only new input counts: a gamepad whose timestamps stop grows old", () => {
  const live = new Liveness();
  live.heardBeacon(1_000_000, 100);
  assert.equal(live.gamepad(5, 100), false, "the first look is no input");
  assert.equal(live.gamepad(6, 104), true);
  assert.equal(live.gamepad(7, 108), true, "a held stick with live timestamps");
  assert.equal(live.sequence, 2);
  for (let now = 112; now < 108 + SILENT_MS; now += 4) {
    live.heardBeacon(now * 10_000, now);
    assert.equal(live.gamepad(7, now), false);
  }
  assert.equal(live.sequence, 2);
  assert.equal(live.frozen(108 + SILENT_MS), null);
  assert.equal(live.frozen(109 + SILENT_MS), "silent");
});

test("an input is tied to the beacon that was newest then, and keeps it", () => {
  const live = new Liveness();
  live.heardBeacon(123_456_789_000, 1000);
  live.input(1012.5);
  live.heardBeacon(123_506_789_000, 1050);
  assert.deepEqual(live.tied, { beacon_ns: 123_456_789_000, since_ms: 12.5 });
});

test("nothing counts while the page is hidden, in the back, or without beacons", () => {
  const live = new Liveness();
  assert.equal(live.input(0), false, "no beacon yet");
  assert.equal(live.frozen(0), "beacon");
  live.heardBeacon(1, 0);
  for (const reason of ["hidden", "blurred", "unplugged"]) {
    live.block(reason);
    assert.equal(live.input(1), false, reason);
    assert.equal(live.frozen(1), reason);
    live.unblock(reason);
  }
  assert.equal(live.input(1), true);
  assert.equal(live.input(BEACON_MS + 1), false);
  assert.equal(live.sequence, 1);
});

test("a gamepad pulled out counts for nothing until it is back or another hand moves", () => {
  const live = new Liveness();
  live.heardBeacon(1, 0);
  live.newGamepad();
  live.gamepad(5, 1);
  live.gamepad(6, 2);
  live.lostGamepad();
  assert.equal(live.frozen(3), "unplugged");
  assert.equal(live.input(3), false);
  assert.equal(live.touched(4), true);
  assert.equal(live.frozen(4), null);
  live.lostGamepad();
  live.newGamepad();
  assert.equal(live.gamepad(7, 5), false, "its first look is no input");
  assert.equal(live.gamepad(8, 6), true);
  assert.equal(live.sequence, 3);
});

test("a frame says what the hand did; a block lets go of the button at once", () => {
  const live = new Liveness();
  const wish = { forward: 0.4, left: 0, up: 0, turn: -0.1, held: true, arm: "absent" };
  const switches = { height_hold: true, heading_hold: false };
  assert.equal(frame(3, live, wish, switches, 0), null, "no input yet");
  live.heardBeacon(123, 0);
  live.input(12.5);
  assert.equal(frame(0, live, wish, switches, 13), null, "no lease");
  assert.deepEqual(frame(3, live, wish, switches, 13), {
    lease: 3, input_sequence: 1, beacon_ns: 123, since_ms: 12.5, forward: 0.4, left: 0, up: 0, turn: -0.1, held: true, height_hold: true, heading_hold: false, arm: "absent",
  });
  live.block("hidden");
  const blocked = frame(3, live, { ...wish, arm: "on" }, switches, 14);
  assert.equal(blocked.held, false);
  assert.equal(blocked.forward, 0);
  assert.equal(blocked.arm, "on", "a switch that stands is not thrown");
});

test("frames go out on new input, at 50 Hz while held, and never more than a hundred a second", () => {
  const count = (held, inputEvery) => {
    const pace = new Pace();
    let sent = 0;
    let sequence = 0;
    for (let now = 0; now < 1000; now += 1) {
      if (inputEvery && now % inputEvery === 0) sequence += 1;
      if (pace.due(sequence, held, now)) {
        pace.mark(sequence, held, now);
        sent += 1;
      }
    }
    return sent;
  };
  assert.ok(Math.abs(count(true, 1) - 1000 / LEAST_MS) <= 2);
  assert.ok(Math.abs(count(true, 0) - 1000 / HELD_MS) <= 3);
  assert.ok(Math.abs(count(false, 0) - 1000 / IDLE_MS) <= 1);
  const pace = new Pace();
  pace.mark(4, true, 100);
  assert.equal(pace.due(4, false, 100), true, "letting go waits for nothing");
});

test("a stick that moves right after a repeated frame waits for nothing, one that never rests for its turn", () => {
  const pace = new Pace();
  for (const now of [0, 20, 40]) pace.mark(1, true, now);
  assert.equal(pace.due(2, true, 41), true);
  pace.mark(2, true, 41);
  assert.equal(pace.due(3, true, 45), false);
  assert.equal(pace.due(3, true, 51), true);
});

test("sources are joined: who moves flies, any button holds", () => {
  const still = { forward: 0, left: 0, up: 0, turn: 0, held: false, arm: "off" };
  assert.deepEqual(join([still, { ...still, forward: 0.5, arm: "absent" }, { ...still, held: true, arm: "absent" }]), { forward: 0.5, left: 0, up: 0, turn: 0, held: true, arm: "off" });
  assert.deepEqual(join([null]), { forward: 0, left: 0, up: 0, turn: 0, held: false, arm: "absent" });
});

test("keys: opposite ones cancel, space holds", () => {
  assert.deepEqual(wishOf(new Set(["KeyW", "KeyD", "Space"])), { forward: KEY_SHARE, left: -KEY_SHARE, up: 0, turn: 0, held: true, arm: "absent" });
  assert.equal(wishOf(new Set(["KeyW", "KeyS"])).forward, 0);
  assert.ok(flies("Space") && flies("ArrowLeft") && !flies("Escape") && !flies("toString"));
});
