// What is told of recordings, made safe to show: lengths, sizes, which files belong together. No DOM, no clock.

import { list } from "./lists.js";

/** What the console says of a drone's recording: {on, lasts_ms, account, trouble}. */
export function recordingOf(told) {
  const on = Number.isFinite(told?.since_ms);
  return {
    on,
    lasts_ms: on && Number.isFinite(told.lasts_ms) ? Math.max(0, told.lasts_ms) : 0,
    account: typeof told?.account === "string" ? told.account : "",
    trouble: typeof told?.trouble === "string" ? told.trouble : "",
  };
}

/** Bytes as a number with a unit: {key: "kb" | "mb" | "gb", value}. */
export function sizeParts(bytes) {
  const size = Math.max(0, Number(bytes) || 0);
  if (size < 1e6) return { key: "kb", value: Math.max(size > 0 ? 1 : 0, Math.round(size / 1e3)), digits: 0 };
  if (size < 1e9) return { key: "mb", value: size / 1e6, digits: size < 1e7 ? 1 : 0 };
  return { key: "gb", value: size / 1e9, digits: 1 };
}

/** Seconds of a recording; null while it is being written. */
export function lengthOf(recording) {
  return Number.isFinite(recording.ended_ms) ? Math.max(0, recording.ended_ms - recording.started_ms) / 1000 : null;
}

/** The recordings of a list, the newest first; each says which part of its recording it is: {part, parts}. */
export function recordingsOf(answer) {
  const all = list(answer?.recordings, "recordings").filter((one) => Number.isFinite(one?.id) && Number.isFinite(one?.started_ms));
  const families = new Map();
  for (const one of [...all].sort((a, b) => a.started_ms - b.started_ms || a.id - b.id)) {
    const first = one.follows ?? one.id;
    families.set(first, [...(families.get(first) ?? []), one.id]);
  }
  return all.map((one) => {
    const family = families.get(one.follows ?? one.id);
    return { ...one, part: family.indexOf(one.id) + 1, parts: family.length };
  });
}

/** The files that were kept for an incident, the first one first. */
export function clipsOf(incident, recordings) {
  return recordings.filter((one) => one.incident === incident && Number.isFinite(incident)).sort((a, b) => a.started_ms - b.started_ms);
}
