import { test } from "node:test";
import assert from "node:assert/strict";
import { groups, isOwnMachine } from "../app/pure/devices.js";

test("a phone does not reach this machine's own addresses", () => {
  for (const own of ["localhost", "127.0.0.1", "127.8.9.10", "[::1]"]) assert.ok(isOwnMachine(own), own);
  for (const other of ["drone.local", "192.168.4.20", "localhost.example.org", "1270.0.0.1", "[fe80::1]"]) assert.ok(!isOwnMachine(other), other);
});

test("a fingerprint is sixteen groups or nothing", () => {
  const good = Array.from({ length: 16 }, (_, k) => (0xa0f0 + k).toString(16).toUpperCase());
  assert.deepEqual(groups(good.join(" ")), good);
  for (const wrong of [null, undefined, 7, "", good.slice(1).join(" "), good.join(" ").toLowerCase(), good.join(":"), `${good.join(" ")} A0F0`]) {
    assert.deepEqual(groups(wrong), [], String(wrong));
  }
});
