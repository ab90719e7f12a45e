// The one thing to read first: what the drone does, where, how sure it is, and how old that is.

import { ageParts, clock } from "../pure/age.js";
import { CAUSES, PATROL, PHASES, inFlight, word } from "../pure/codes.js";
import { roomAt } from "../pure/rooms.js";
import { h, icon, setData, setIcon, setText, show } from "../view/dom.js";
import { sentence } from "../words/sentences.js";
import { capital, t, written } from "../words/text.js";

const TRUST_ICON = { sure: "check", fair: "check", unsure: "alert", searching: "eye", lost: "alert" };
const PHASE_ICON = { grounded: "land", arming: "takeoff", takeoff: "takeoff", hover: "pause", autonomous: "lantern", manual: "sticks", landing: "land", emergency: "alert", cut: "cut" };

const DOING_ICON = { "doing.flying": "lantern", "doing.paused": "pause", "doing.returning": "home", "doing.landing": "land", "doing.going": "target", "doing.planning": "wait", "doing.stopped": "stop" };
/** How sure it is changes with every message; words that change so often cannot be read. */
const CALM_MS = 1000;

/** An age in words: "0.3 s", "4 s", "2 min". */
export function ageWords(ms) {
  const { key, value } = ageParts(ms);
  return `${written(value)} ${t(`unit.${key}`)}`;
}

export function trustWords(trust) {
  const within = trust.within ? `${written(trust.within.value)}${trust.within.unit ? ` ${trust.within.unit}` : ""}` : "";
  return t(trust.key, { within, places: trust.within?.value ?? "" });
}

/** What the drone does, as key of the words: the phase, or the round's state where that says more. */
export function doing(pilot, patrol) {
  if (!pilot) return "phase.unknown";
  const phase = word(PHASES, pilot.phase);
  if (pilot.stop_lands_ns) return "doing.stopped";
  if ((phase === "autonomous" || phase === "hover") && patrol) {
    const round = word(PATROL, patrol.state);
    if (["planning", "flying", "paused", "returning", "landing", "going"].includes(round)) return `doing.${round}`;
  }
  return `phase.${phase}`;
}

export class SituationPanel {
  constructor(session) {
    this.session = session;
    this.phaseIcon = icon("lantern");
    this.title = h("h1", { class: "situation-title" });
    this.place = h("p", { class: "situation-place" });
    this.trustIcon = icon("check");
    this.trustWords = h("span", {});
    this.trust = h("p", { class: "chip" }, this.trustIcon, this.trustWords);
    this.ageWords = h("span", {});
    this.age = h("p", { class: "chip quiet-chip" }, h("span", { class: "dot", "aria-hidden": "true" }), this.ageWords);
    this.spoken = h("p", { class: "unseen", role: "status", "aria-live": "polite", id: "situation-words" });
    this.element = h("section", { class: "situation", "aria-label": t("situation.name") },
      h("div", { class: "situation-head" }, h("span", { class: "situation-sign" }, this.phaseIcon), h("div", {}, this.title, this.place)),
      h("div", { class: "chips" }, this.trust, this.age), this.spoken);
  }
  update(now) {
    const { pilot, patrol, pose, telemetry, about } = this.session;
    const fresh = telemetry.news.freshness("pilot/state", now);
    const phase = pilot ? word(PHASES, pilot.phase) : "unknown";
    const key = doing(pilot, patrol);
    const title = t(key);
    setText(this.title, title);
    setIcon(this.phaseIcon, DOING_ICON[key] ?? PHASE_ICON[phase] ?? "wait");
    setData(this.element, "phase", phase);
    const room = pose && !pose.searching ? roomAt(about?.rooms ?? [], pose.x_m, pose.y_m) : null;
    setText(this.place, this.placeWords(pilot, patrol, room));
    const trust = this.session.trust;
    show(this.trust, Boolean(pose));
    if (trust.key !== this.trustKey || now - this.trustAt > CALM_MS) {
      this.trustKey = trust.key;
      this.trustAt = now;
      setText(this.trustWords, trustWords(trust));
    }
    setIcon(this.trustIcon, TRUST_ICON[trust.level]);
    setData(this.trust, "level", trust.level);
    const age = telemetry.news.age(now);
    const words = age === null ? t("age.none") : age < 1000 ? t("age.live") : t("age.old", { age: ageWords(age) });
    setText(this.ageWords, words);
    setData(this.age, "fresh", telemetry.news.whole(now));
    setData(this.element, "fresh", fresh);
    const said = `${title}. ${room ? `${room}. ` : ""}${trust.level === "sure" ? "" : trustWords(trust)}`;
    if (said !== this.said) {
      this.said = said;
      setText(this.spoken, said);
    }
  }
  placeWords(pilot, patrol, room) {
    if (!pilot) return t("situation.waiting");
    if (pilot.stop_lands_ns) {
      const left = Math.max(0, (pilot.stop_lands_ns - pilot.header.stamp_ns) / 1e9);
      return t("situation.stop_lands", { time: clock(left) });
    }
    const flying = inFlight(pilot.phase);
    const round = flying && patrol && [2, 3, 4, 5, 8].includes(patrol.state) && patrol.text ? sentence(patrol.text) : "";
    const text = round || (word(CAUSES, pilot.cause) !== "none" ? "" : sentence(pilot.text ?? ""));
    const same = text.toLowerCase() === t(doing(pilot, patrol)).toLowerCase();
    return [room, same ? "" : capital(text)].filter(Boolean).join(" · ");
  }
}
