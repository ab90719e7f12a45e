// The state of the connection, in the bar: which drone, whether it is there, how old the newest news is.

import { h, setData, setText } from "../view/dom.js";
import { t } from "../words/text.js";
import { ageWords } from "./situation.js";

export function linkState(telemetry, now) {
  if (!telemetry.connected) return "closed";
  if (telemetry.alive === false) return "away";
  return { live: "live", late: "late", stale: "stale", none: "waiting" }[telemetry.news.whole(now)];
}

export class LinkPanel {
  constructor(session, drones) {
    this.session = session;
    this.words = h("span", { class: "link-words" });
    const name = drones.length > 1
      ? h("select", { class: "select small-select", "aria-label": t("link.drone"), onchange: (event) => {
          location.hash = `#/watch/${encodeURIComponent(event.target.value)}`;
        } }, drones.map((drone) => h("option", { value: drone, selected: drone === session.drone }, drone)))
      : h("strong", {}, session.drone);
    this.simulated = h("span", { class: "pill info only-wide" }, t("drones.simulated"));
    this.simulated.hidden = true;
    this.element = h("div", { class: "link", data: { state: "waiting" } }, h("span", { class: "dot", "aria-hidden": "true" }), name, this.words, this.simulated);
  }
  update(now) {
    const { telemetry, about } = this.session;
    const state = linkState(telemetry, now);
    setData(this.element, "state", state);
    const age = telemetry.news.age(now);
    setText(this.words, state === "stale" || state === "late" ? t("link.stale", { age: ageWords(age) }) : t(`link.${state}`));
    this.simulated.hidden = !about?.simulated;
  }
}
