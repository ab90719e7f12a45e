// Recordings as the page tells of them.

import assert from "node:assert/strict";
import { test } from "node:test";
import { clipsOf, lengthOf, recordingOf, recordingsOf, sizeParts } from "../app/pure/recording.js";

test("only what the console says is a recording is one", () => {
  assert.deepEqual(recordingOf({ since_ms: 5, lasts_ms: 70, account: "ana", trouble: "" }), { on: true, lasts_ms: 70, account: "ana", trouble: "" });
  for (const told of [null, undefined, {}, { since_ms: null, lasts_ms: null }, { since_ms: "5" }, 7, "x"]) {
    assert.equal(recordingOf(told).on, false);
    assert.equal(recordingOf(told).lasts_ms, 0);
  }
  assert.equal(recordingOf({ since_ms: 5, lasts_ms: -9 }).lasts_ms, 0);
});

test("sizes are said in the unit that is read most easily", () => {
  assert.deepEqual([0, 1, 999_499, 4_560_000, 45_600_000, 4_560_000_000].map((bytes) => sizeParts(bytes).key), ["kb", "kb", "kb", "mb", "mb", "gb"]);
  assert.equal(sizeParts(1).value, 1);
  assert.equal(sizeParts("nonsense").value, 0);
});

test("files of one recording are numbered in the order of time, and those of an incident are found", () => {
  const all = recordingsOf({ recordings: [
    { id: 9, started_ms: 900, ended_ms: null, follows: 4, incident: null },
    { id: 5, started_ms: 500, ended_ms: 800, follows: 4, incident: null },
    { id: 7, started_ms: 450, ended_ms: 460, follows: 6, incident: 3 },
    { id: 6, started_ms: 440, ended_ms: 450, follows: null, incident: 3 },
    { id: 4, started_ms: 400, ended_ms: 2400, follows: null, incident: null },
    { id: "4", started_ms: 1 },
    null,
  ] });
  assert.deepEqual(all.map((one) => [one.id, one.part, one.parts]), [[9, 3, 3], [5, 2, 3], [7, 2, 2], [6, 1, 2], [4, 1, 3]]);
  assert.deepEqual(all.map(lengthOf), [null, 0.3, 0.01, 0.01, 2]);
  assert.deepEqual(clipsOf(3, all).map((one) => one.id), [6, 7]);
  assert.deepEqual(clipsOf(null, all), []);
  assert.deepEqual(recordingsOf(null), []);
});
