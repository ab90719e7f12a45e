// Height, battery and the way home; what would happen if something were lost now; the round by room; the event log.

import { clock, secondsBetween } from "../pure/age.js";
import { ACTIONS, ROOMS, causesIn, inFlight, word } from "../pure/codes.js";
import { progress } from "../pure/rooms.js";
import { h, fill, icon, setData, setText, show } from "../view/dom.js";
import { sentence } from "../words/sentences.js";
import { capital, number, t, timeOfDay } from "../words/text.js";

const BATTERY_CAUSES = 6;

function gauge(iconName, name) {
  const value = h("strong", {});
  const note = h("span", { class: "gauge-note" });
  const element = h("div", { class: "gauge" }, h("dt", {}, icon(iconName), name), h("dd", {}, value, note));
  return { element, value, note };
}

export class GaugesPanel {
  constructor(session) {
    this.session = session;
    this.height = gauge("height", t("gauge.height"));
    this.battery = gauge("battery", t("gauge.battery"));
    this.home = gauge("home", t("gauge.home"));
    this.level = h("meter", { class: "battery-bar", min: 0, max: 1, low: 0.3, high: 0.5, optimum: 1, "aria-label": t("gauge.battery") });
    this.battery.element.append(this.level);
    this.element = h("section", { class: "panel gauges", "aria-label": t("gauge.name") }, h("dl", {}, this.height.element, this.battery.element, this.home.element));
  }
  update(now) {
    const { pilot, telemetry, battery } = this.session;
    const flying = pilot && inFlight(pilot.phase);
    setText(this.height.value, pilot && Number.isFinite(pilot.height_m) ? `${number(pilot.height_m, 2)} m` : "–");
    setText(this.height.note, !pilot ? "" : pilot.on_ground ? t("gauge.on_ground") : pilot.climb_m_s > 0.08 ? t("gauge.climbing") : pilot.climb_m_s < -0.08 ? t("gauge.sinking") : t("gauge.steady"));
    const fresh = telemetry.news.freshness("flight/power", now);
    setData(this.battery.element, "fresh", fresh);
    setText(this.battery.value, battery.minutes !== null ? t("gauge.minutes", { minutes: number(Math.floor(battery.minutes)) }) : battery.share !== null ? `${number(100 * battery.share)} %` : "–");
    setText(this.battery.note, battery.minutes !== null ? `${number(100 * battery.share)} %` : battery.cell_volts ? t("gauge.cell", { volts: number(battery.cell_volts, 2) }) : "");
    show(this.level, battery.share !== null);
    if (battery.share !== null) this.level.value = battery.share;
    const causes = pilot ? causesIn(pilot.causes) : [];
    const short = causes.some((code) => code === BATTERY_CAUSES || code === BATTERY_CAUSES + 1);
    const reach = !pilot ? "unknown" : !flying ? "ground" : short ? "short" : fresh === "none" || fresh === "stale" ? "unknown" : "reach";
    setData(this.home.element, "reach", reach);
    setText(this.home.value, t(`home.${reach}`));
    setText(this.home.note, t(`home_note.${reach}`));
  }
}

const LOSSES = [["if_pose_lost", "loss.pose"], ["if_sonars_lost", "loss.sonars"], ["if_height_lost", "loss.height"], ["if_operator_lost", "loss.operator"], ["if_navigation_lost", "loss.navigation"], ["if_controller_lost", "loss.controller"], ["if_charge_lost", "loss.charge"]];
const SEVERE = { none: "ok", hover: "info", return: "info", land: "caution", descend: "caution", cut: "alarm" };

export class LossesPanel {
  constructor(session) {
    this.session = session;
    this.rows = LOSSES.map(([field, key]) => {
      const what = h("span", { class: "pill" });
      return { field, what, element: h("li", {}, h("span", {}, t(key)), what) };
    });
    this.note = h("p", { class: "quiet small" }, t("loss.ground"));
    this.list = h("ul", { class: "losses" }, this.rows.map((row) => row.element));
    this.element = h("details", { class: "panel losses-panel", open: matchMedia("(min-width: 1900px)").matches }, h("summary", {}, icon("shield"), h("h2", {}, t("loss.name"))), this.note, this.list);
  }
  update() {
    const { pilot } = this.session;
    const flying = Boolean(pilot && inFlight(pilot.phase));
    show(this.list, flying);
    show(this.note, !flying);
    if (!flying) return;
    for (const { field, what } of this.rows) {
      const action = word(ACTIONS, pilot[field] ?? 0);
      setText(what, t(`then.${action}`));
      setData(what, "tone", SEVERE[action] ?? "caution");
    }
  }
}

const ROOM_ICON = { waiting: "wait", entered: "eye", seen: "check", skipped: "skip", partly: "half" };

export class RoundPanel {
  constructor(session) {
    this.session = session;
    this.count = h("span", { class: "panel-note" });
    this.bar = h("meter", { class: "round-bar", min: 0, max: 1, "aria-label": t("round.coverage") });
    this.rows = h("ol", { class: "rooms" });
    this.none = h("p", { class: "quiet small" }, t("round.none"));
    this.report = h("a", { class: "button primary round-report", hidden: true }, icon("report"), h("span", {}, t("round.report")));
    this.element = h("section", { class: "panel round", "aria-labelledby": "round-name" },
      h("header", { class: "panel-head" }, icon("lantern"), h("h2", { id: "round-name" }, t("round.name")), this.count), this.bar, this.none, this.report, this.rows);
    this.drawn = "";
  }
  update() {
    const { patrol } = this.session;
    const rooms = (patrol?.rooms ?? []).slice(0, patrol?.rooms_used ?? 0);
    show(this.none, rooms.length === 0);
    show(this.bar, rooms.length > 0);
    const { report } = this.session.chronicle;
    show(this.report, report !== null && Boolean(patrol) && [0, 6, 7].includes(patrol.state));
    if (report !== null) this.report.setAttribute("href", `#/reports/${report}`);
    const begun = patrol && patrol.state !== 0;
    const { done, all } = progress(patrol);
    const time = begun && ![6, 7].includes(patrol.state) ? secondsBetween(patrol.started_ns, patrol.header.stamp_ns) : null;
    setText(this.count, rooms.length === 0 ? "" : [t("round.count", { done, all }), time !== null && time < 86_400 ? clock(time) : ""].filter(Boolean).join(" · "));
    if (patrol) this.bar.value = patrol.coverage ?? 0;
    const drawn = rooms.map((room) => `${room.name}${room.state}${Math.round(100 * room.seen)}${room.reason}`).join();
    if (drawn === this.drawn) return;
    this.drawn = drawn;
    fill(this.rows, rooms.map((room) => {
      const state = word(ROOMS, room.state);
      const share = state === "entered" || state === "partly" ? `${number(100 * room.seen)} %` : "";
      return h("li", { data: { state } }, h("span", { class: "room-sign" }, icon(ROOM_ICON[state] ?? "wait")),
        h("span", { class: "room-name" }, room.name, room.reason ? h("small", {}, sentence(room.reason)) : null),
        h("span", { class: "room-state" }, share ? `${t(`room.${state}`)} · ${share}` : t(`room.${state}`)));
    }));
  }
}

/** Fills in {key} and {sentence} values of an entry of the chronicle. */
function valuesOf(values) {
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, value?.key ? t(value.key) : value?.sentence !== undefined ? sentence(value.sentence) : value]));
}

/** What the drone says of a cause begins small; names of people stay as they are. */
function wordsOf(key, values) {
  const words = t(key, valuesOf(values)).replace(/: $/, "");
  return key === "event.failsafe" || key === "event.told" ? capital(words) : words;
}

export class EventsPanel {
  constructor(session) {
    this.session = session;
    this.rows = h("ol", { class: "events", tabindex: "0", "aria-labelledby": "events-name" });
    this.none = h("p", { class: "quiet small" }, t("events.none"));
    this.element = h("section", { class: "panel events-panel", "aria-labelledby": "events-name" },
      h("header", { class: "panel-head" }, icon("list"), h("h2", { id: "events-name" }, t("events.name"))), this.none, this.rows);
    this.drawn = 0;
  }
  update() {
    const { entries, count } = this.session.chronicle;
    show(this.none, entries.length === 0);
    show(this.rows, entries.length > 0);
    if (count === this.drawn) return;
    this.drawn = count;
    fill(this.rows, entries.slice(0, 120).map(({ at, tone, key, values }) => h("li", { data: { tone } }, h("time", {}, timeOfDay(at)),
      h("span", {}, wordsOf(key, values), values.report ? [" ", h("a", { href: `#/reports/${values.report}` }, t("events.report"))] : null))));
  }
}

