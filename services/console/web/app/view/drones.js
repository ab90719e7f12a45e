// Which drone, when there are several; what to say when there is none.

import * as api from "../net/api.js";
import { h, button, fill, icon } from "./dom.js";
import { trouble } from "./form.js";
import { t } from "../words/text.js";

export function empty(iconName, title, words, ...more) {
  return h("div", { class: "empty" }, icon(iconName), h("h2", {}, title), h("p", {}, words), more);
}

export function noDroneView(session) {
  const words = t(session.account.role === "administrator" ? "none.words_administrator" : "none.words");
  const look = () => dispatchEvent(new Event("sereno:session"));
  const again = button(t("none.again"), null, { class: "primary", onclick: look });
  // A drone that comes into reach, or is assigned, shows itself.
  const timer = setInterval(async () => {
    const now = await api.session().catch(() => null);
    if (now && (!now.account || now.drones.length > 0)) look();
  }, 5000);
  return {
    element: h("div", { class: "page" }, h("div", { class: "card" }, empty("drone", t("none.title"), words, again))),
    title: t("none.title"),
    end: () => clearInterval(timer),
  };
}

export function troubleView(again) {
  return {
    element: h("main", { class: "door", id: "view" }, h("div", { class: "door-inner" }, h("div", { class: "card" },
      empty("link-off", t("error.title"), t("error.unreachable"), button(t("error.again"), null, { class: "primary", onclick: again }))))),
  };
}

function card(drone) {
  return h("li", {}, h("a", { class: "card drone-card", href: `#/watch/${encodeURIComponent(drone.name)}` },
    icon("drone"), h("strong", {}, drone.name),
    h("div", {},
      h("span", { class: `pill ${drone.alive ? "ok" : "caution"}` }, t(drone.alive ? "drones.alive" : "drones.away")),
      drone.simulated ? h("span", { class: "pill info" }, t("drones.simulated")) : null)));
}

export function dronesView() {
  const list = h("div", { "aria-live": "polite" });
  let ended = false;
  const look = async () => {
    try {
      const drones = await api.drones();
      if (!ended) fill(list, h("ul", { class: "drone-cards" }, drones.map(card)));
    } catch (error) {
      if (!ended) fill(list, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    }
  };
  look();
  const timer = setInterval(look, 5000);
  return {
    element: h("div", { class: "page" }, h("div", { class: "page-head" }, h("div", {}, h("h1", {}, t("drones.title")), h("p", {}, t("drones.words")))), list),
    title: t("drones.title"),
    end() {
      ended = true;
      clearInterval(timer);
    },
  };
}
