// The bar above every view, and the place for the view.

import { h, button, icon, iconButton } from "./dom.js";
import { choose } from "./language.js";
import { current, toggle } from "./theme.js";
import { LANGUAGES, currentLanguage, t } from "../words/text.js";

/** Two buttons, one a language. */
export function languageSwitch() {
  return h("div", { class: "segments", role: "group", "aria-label": t("app.language") },
    Object.entries(LANGUAGES).map(([code, name]) => h("button", {
      type: "button", lang: code, "aria-pressed": String(code === currentLanguage()), title: name, "aria-label": name, onclick: () => choose(code),
    }, code.toUpperCase())));
}

export function themeButton() {
  const label = () => t(current() === "dark" ? "app.to_light" : "app.to_dark");
  const make = () => iconButton(label(), current() === "dark" ? "sun" : "moon", { onclick: () => {
    toggle();
    const next = make();
    element.replaceWith(next);
    element = next;
    element.focus();
  } });
  let element = make();
  return element;
}

/** The drone that is looked at now, or the first. */
function droneNow({ drones }) {
  const named = /^#\/(?:watch|plan)\/([^/]+)/.exec(location.hash)?.[1] ?? "";
  const found = drones.find((drone) => encodeURIComponent(drone) === named);
  return encodeURIComponent(found ?? drones[0]);
}

function links(session) {
  const list = [["watch", "#/", "eye", t("nav.watch")]];
  if (session.account.role !== "viewer" && session.drones.length > 0) list.push(["plan", `#/plan/${droneNow(session)}`, "plan", t("nav.plan")]);
  list.push(["reports", "#/reports", "report", t("nav.reports")]);
  if (session.account.role !== "viewer" && session.recording?.keeps) list.push(["recordings", "#/recordings", "record", t("nav.recordings")]);
  if (session.account.role === "administrator") {
    list.push(["accounts", "#/accounts", "users", t("nav.accounts")], ["log", "#/log", "list", t("nav.log")]);
  }
  return list;
}

function navLink([name, href, iconName, words], now) {
  const here = name === now || (name === "watch" && ["drones", "none"].includes(now));
  return h("a", { class: "nav-link", href, "aria-current": here ? "page" : null }, icon(iconName), h("span", {}, words));
}

/** A button that opens a list below itself; Escape, a click elsewhere or a choice closes it. */
export function menu(opener, items, more = {}) {
  const list = h("div", { class: "menu-list", hidden: true }, items);
  const element = h("div", { class: "menu", ...more }, opener, list);
  const set = (open) => {
    list.hidden = !open;
    opener.setAttribute("aria-expanded", String(open));
  };
  set(false);
  opener.addEventListener("click", () => set(list.hidden));
  element.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || list.hidden) return;
    event.stopPropagation();
    set(false);
    opener.focus();
  });
  element.addEventListener("focusout", (event) => {
    if (event.relatedTarget && !element.contains(event.relatedTarget)) set(false);
  });
  const away = (event) => {
    if (!element.isConnected) removeEventListener("pointerdown", away);
    else if (!element.contains(event.target)) set(false);
  };
  addEventListener("pointerdown", away);
  list.addEventListener("click", (event) => {
    if (event.target.closest("a, button") && !event.target.closest(".bar-choices")) set(false);
  });
  return element;
}

function initials(account) {
  return `${account.name?.[0] ?? ""}${account.surname?.[0] ?? ""}`.toUpperCase();
}

/** The whole frame around `view` {element, bar}; `alarm` is an element between bar and view, or null. */
export function frame(name, session, view, alarm, actions) {
  const { account } = session;
  const who = h("div", { class: "menu-who" },
    h("strong", {}, `${account.name} ${account.surname}`), h("span", {}, `${account.email} · ${t(`role.${account.role}`)}`));
  const opener = h("button", { type: "button", class: "icon-button", "aria-label": t("app.account"), title: t("app.account") }, h("span", { class: "avatar", "aria-hidden": "true" }, initials(account)));
  const narrowLinks = h("div", { class: "only-narrow" }, links(session).map((link) => navLink(link, name)));
  const list = menu(opener, [
    who, h("div", { class: "bar-choices only-narrow" }, languageSwitch(), themeButton()), narrowLinks,
    h("a", { class: "nav-link", href: "#/password" }, icon("key"), h("span", {}, t("nav.password"))),
    button(t("nav.logout"), "out", { onclick: actions.out }),
  ]);
  return h("div", { class: "frame", data: { view: name } },
    h("a", { class: "skip", href: "#view", onclick: (event) => {
      event.preventDefault();
      document.getElementById("view")?.focus();
    } }, t("app.skip")),
    h("header", { class: "bar" },
      h("a", { class: "brand", href: "#/", "aria-label": "Sereno" }, h("img", { src: "/app/mark.svg", alt: "" }), h("span", {}, "Sereno")),
      view.bar ?? null,
      h("div", { class: "gap" }),
      h("nav", { class: "only-wide", "aria-label": t("nav.name") }, h("ul", {}, links(session).map((link) => h("li", {}, navLink(link, name))))),
      h("div", { class: "bar-choices only-wide" }, languageSwitch(), themeButton()), list),
    alarm,
    h("main", { id: "view", tabindex: "-1" }, view.element));
}
