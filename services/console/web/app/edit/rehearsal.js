// Flights in the simulator before the drone flies: how many, how far they are, what came of each.

import * as api from "../net/api.js";
import { clock } from "../pure/age.js";
import { h, button, fill, icon, setData, setText, show } from "../view/dom.js";
import { trouble } from "../view/form.js";
import { sentence } from "../words/sentences.js";
import { number, t } from "../words/text.js";

const LOOK_MS = 800;
const FLIGHTS = [1, 2, 3, 5];

function good(flight) {
  return flight.outcome === "landed_on_pad" && flight.contacts === 0;
}

function flightRow(flight) {
  const facts = [
    [t("rehearse.time"), `${clock(flight.time_s)} min`], [t("rehearse.seen"), `${number(100 * flight.coverage)} %`],
    [t("rehearse.contacts"), number(flight.contacts)], [t("rehearse.closest"), `${number(flight.min_clearance_m, 2)} m`], [t("rehearse.way"), `${number(flight.distance_m)} m`],
  ];
  const remarks = [...flight.skipped.map((room) => t("rehearse.skipped", { room: sentence(room) })), ...flight.failsafes.map((one) => t("rehearse.failsafe", { what: sentence(one) }))];
  return h("li", { class: "flight", data: { good: String(good(flight)) } },
    h("div", { class: "flight-head" }, icon(good(flight) ? "check" : "alert"), h("strong", {}, t(`outcome.${flight.outcome}`))),
    h("dl", { class: "flight-facts" }, facts.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value)))),
    remarks.length > 0 ? h("ul", { class: "flight-remarks" }, remarks.map((words) => h("li", {}, words))) : null);
}

export class RehearsalPanel {
  constructor(desk) {
    this.desk = desk;
    this.available = false;
    this.running = null;
    /** What was on the desk when the last one began. */
    this.of = null;
    this.ended = false;
    this.flights = h("select", { class: "select small-select", "aria-label": t("rehearse.flights") }, FLIGHTS.map((count) => h("option", { value: String(count) }, count === 1 ? t("rehearse.one") : t("rehearse.many", { count }))));
    this.go = button(t("rehearse.go"), "play", { onclick: () => this.begin() });
    this.note = h("p", { class: "quiet small" }, t("rehearse.words"));
    this.bar = h("progress", { class: "flight-bar", "aria-label": t("rehearse.progress") });
    this.bar.hidden = true;
    this.old = h("p", { class: "quiet small" }, t("rehearse.old"));
    this.result = h("div", { class: "rehearsed", "aria-live": "polite" });
    this.element = h("section", { class: "panel rehearse" }, h("div", { class: "panel-head" }, icon("takeoff"), h("h2", {}, t("rehearse.title"))), this.note,
      h("div", { class: "rehearse-row" }, this.flights, this.go), this.bar, this.old, this.result);
    this.look();
  }
  async look() {
    try {
      const { available, text } = await api.rehearsals(this.desk.drone);
      if (this.ended) return;
      this.available = available;
      if (!available) setText(this.note, sentence(text));
    } catch (error) {
      if (!this.ended) setText(this.note, trouble(error));
    }
    this.update();
  }
  update() {
    const { desk } = this;
    const old = this.of !== null && this.of !== desk.state;
    show(this.old, old);
    setData(this.result, "old", String(old));
    this.go.disabled = !this.available || this.running !== null || (desk.draft !== null && !desk.isMade);
  }
  async begin() {
    const { desk } = this;
    this.running = "asked";
    this.of = desk.state;
    fill(this.result);
    this.update();
    try {
      const flights = Number(this.flights.value);
      const begun = await api.rehearse(desk.drone, { draft: desk.draft?.id ?? null, building: desk.building, flights });
      this.running = begun.id;
      await this.follow(begun);
    } catch (error) {
      fill(this.result, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    }
    this.running = null;
    show(this.bar, false);
    this.update();
  }
  async follow(rehearsal) {
    let now = rehearsal;
    for (;;) {
      this.show(now);
      if (now.state !== "running" || this.ended) return;
      await new Promise((resolve) => { setTimeout(resolve, LOOK_MS); });
      if (this.ended) return;
      now = await api.rehearsal(this.desk.drone, rehearsal.id);
    }
  }
  show({ state, text, flights, flown }) {
    show(this.bar, state === "running");
    this.bar.max = flights;
    if (flown.length > 0) this.bar.value = flown.length;
    else this.bar.removeAttribute("value");
    fill(this.result,
      state === "running" ? h("p", { class: "quiet small" }, t("rehearse.running", { done: flown.length, all: flights })) : null,
      state === "failed" ? h("p", { class: "note bad" }, icon("alert"), h("span", {}, sentence(text))) : null,
      h("ul", { class: "flights" }, flown.map(flightRow)));
  }
  /** Something else lies on the desk. */
  clear() {
    this.of = null;
    fill(this.result);
    this.update();
  }
  end() {
    this.ended = true;
  }
}
