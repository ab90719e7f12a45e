// The event log of a watch: what changed, as entries {at, kind, tone, key, values}. Words are found when it is shown.

import { ACTIONS, CAUSES, PATROL, PHASES, ROOMS, STICKS, word } from "./codes.js";

const MOST = 300;
/** Within this a failsafe that ended goes on. */
const AGAIN_MS = 5000;
/** The pilot's words for its phases, where they are not those of the word lists. */
const PHASE_WORD = { "take-off": "takeoff", "emergency landing": "emergency" };
const PHASE_TONE = { emergency: "alarm", cut: "alarm", manual: "lamp" };

export class Chronicle {
  /** `began` is when this page began to look on: what changed since then it sees by itself. */
  constructor(began = 0) {
    this.entries = [];
    this.count = 0;
    this.before = null;
    /** Number of the newest report that was written while this page looked on; null before any. */
    this.report = null;
    this.over = null;
    this.began = began;
    this.told_before = new Set();
    /** Of what the console told: whether the failsafe that holds is none to a guard, which one it is, and which was over last. */
    this.quiet = false;
    this.toldNow = "";
    this.toldOver = null;
  }
  /** Newest first, also when the console tells of what was before. */
  add(at, kind, tone, key, values = {}) {
    this.count += 1;
    const place = this.entries.findIndex((entry) => entry.at <= at);
    this.entries.splice(place < 0 ? this.entries.length : place, 0, { number: this.count, at, kind, tone, key, values });
    if (this.entries.length > MOST) this.entries.length = MOST;
    return this.count;
  }
  /** Compares with what was there at the last look; the first look tells nothing but how things stand. */
  look(pilot, patrol, pose, at) {
    const now = {
      phase: pilot ? word(PHASES, pilot.phase) : null,
      failsafe: pilot && pilot.cause > 0 && pilot.action > 0 ? `${word(CAUSES, pilot.cause)}/${word(ACTIONS, pilot.action)}` : "",
      holder: pilot?.holder ?? "",
      sticks: pilot ? word(STICKS, pilot.sticks ?? 0) : null,
      automatic: pilot?.automatic ?? 1,
      round: patrol ? word(PATROL, patrol.state) : null,
      rooms: patrol ? (patrol.rooms ?? []).slice(0, patrol.rooms_used).map((room) => ({ name: room.name, state: word(ROOMS, room.state), reason: room.reason })) : null,
    };
    const before = this.before;
    this.before = { ...now, rooms: now.rooms ?? before?.rooms ?? null, phase: now.phase ?? before?.phase, round: now.round ?? before?.round };
    if (!before) return;
    if (before.phase && now.phase && now.phase !== before.phase) this.add(at, "phase", PHASE_TONE[now.phase] ?? "info", `phase.${now.phase}`);
    if (now.failsafe !== before.failsafe) this.failsafe(now.failsafe, before.failsafe, at);
    if (now.holder !== before.holder) {
      if (now.holder) this.add(at, "sticks", "lamp", "event.holder", { holder: now.holder });
      else this.add(at, "sticks", "info", "event.no_holder");
    }
    if (now.automatic !== before.automatic) this.add(at, "automatic", "caution", now.automatic ? "event.automatic_on" : "event.automatic_off");
    if (before.round && now.round && now.round !== before.round && now.round !== "idle") this.add(at, "round", now.round === "failed" ? "alarm" : "info", `round.${now.round}`);
    for (const room of now.rooms ?? []) {
      const was = before.rooms?.find((one) => one.name === room.name);
      if (!was || was.state === room.state || !["seen", "skipped", "partly"].includes(room.state)) continue;
      this.add(at, "room", room.state === "seen" ? "ok" : "caution", `event.room_${room.state}`, { room: room.name, reason: { sentence: room.reason } });
    }
  }
  /** A failsafe that comes again at once is the same one going on: its end is taken back. */
  failsafe(now, before, at) {
    if (!now) {
      this.over = { failsafe: before, at, number: this.add(at, "failsafe", "ok", "event.failsafe_over") };
      return;
    }
    const { over } = this;
    this.over = null;
    if (over && over.failsafe === now && at - over.at < AGAIN_MS) {
      this.entries = this.entries.filter((entry) => entry.number !== over.number);
      this.count += 1;
      return;
    }
    const [cause, action] = now.split("/");
    this.add(at, "failsafe", "alarm", "event.failsafe", { cause: { key: `cause.${cause}` }, action: { key: `action.${action}` } });
  }
  /** An order of one's own that never got through; what came of all others the console tells everybody. */
  ordered(verb, { outcome }, at) {
    if (outcome === "unsent" || outcome === "unanswered") this.add(at, "order", "caution", `event.order_${outcome}`, { verb: { key: `verb.${verb}` } });
  }
  /** A line of the console, {time_ms, kind, text, account?, verb?, accepted?, report?}. A page that comes, or comes again, is told the last hundred. */
  told(line, at) {
    if (line === null || typeof line !== "object") return;
    const same = [line.time_ms, line.kind, line.text, line.verb, line.account].join("|");
    if (Number.isFinite(line.time_ms)) {
      if (this.told_before.has(same)) return;
      this.told_before.add(same);
      if (this.told_before.size > 2 * MOST) this.told_before.delete(this.told_before.values().next().value);
    }
    const old = Number.isFinite(line.time_ms) && line.time_ms < this.began;
    if (line.kind === "phase" || line.kind === "failsafe") {
      if (old) this.toldState(line);
      return;
    }
    const when = Number.isFinite(line.time_ms) ? line.time_ms : at;
    const values = { who: line.account ?? "", text: { sentence: String(line.text ?? "") } };
    if (line.kind === "order") {
      const key = line.accepted ? "event.order_accepted" : "event.order_refused";
      this.add(when, "order", line.accepted ? "lamp" : "caution", key, { ...values, verb: { key: `verb.${line.verb}` } });
    } else if (line.kind === "incident") this.add(when, "incident", "caution", "event.incident", values);
    else if (Number.isFinite(line.report)) {
      if (!old) this.report = line.report;
      this.add(when, "report", "ok", "event.report", { ...values, report: line.report });
    } else if (line.kind === "round" && line.text === "started") this.add(when, "round", "lamp", "event.round_started");
    else this.add(when, "told", line.kind !== "link" ? "info" : line.text === "connection found" ? "ok" : "caution", "event.told", values);
  }
  /** A phase or a failsafe from before this page was opened. */
  toldState({ time_ms, kind, text, verb }) {
    if (kind === "failsafe") {
      this.toldFailsafe(time_ms, text, verb ?? "");
      return;
    }
    const phase = PHASE_WORD[text] ?? text;
    if (PHASES.includes(phase)) this.add(time_ms, "phase", PHASE_TONE[phase] ?? "info", `phase.${phase}`);
  }
  toldFailsafe(at, cause, action) {
    const ended = cause === "none";
    // What does nothing and what a guard ordered is no failsafe to a guard, and its end says nothing either.
    if (!ended) this.quiet = action === "none" || cause === "operator";
    if (this.quiet) return;
    if (ended) {
      this.toldOver = { failsafe: this.toldNow, at, number: this.add(at, "failsafe", "ok", "event.failsafe_over") };
      this.quiet = true;
      return;
    }
    const over = this.toldOver;
    this.toldOver = null;
    this.toldNow = `${cause}/${action}`;
    if (over && over.failsafe === this.toldNow && at - over.at < AGAIN_MS) this.entries = this.entries.filter((entry) => entry.number !== over.number);
    else this.add(at, "failsafe", "alarm", "event.failsafe", { cause: { sentence: cause }, action: { sentence: action } });
  }
}
