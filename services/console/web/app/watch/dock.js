// The orders. Stop is large and always there; cutting the motors stands apart and must be held.

import * as api from "../net/api.js";
import { Hold } from "../pure/hold.js";
import { offers } from "../pure/offers.js";
import { roomAt } from "../pure/rooms.js";
import { h, button, fill, icon, setData, setIcon, setText, show } from "../view/dom.js";
import { openDialog } from "../view/dialog.js";
import { form } from "../view/form.js";
import { sentence } from "../words/sentences.js";
import { number, t } from "../words/text.js";

const CUT_HOLD_MS = 1000;
/** How long an answer is shown. */
const ACCEPTED_MS = 4000;
const REFUSED_MS = 15_000;

export class DockPanel {
  /** `actions`: sticks() opens or closes manual control. */
  constructor(session, plan, actions) {
    this.session = session;
    this.plan = plan;
    this.keeps = actions.keeps;
    this.pending = new Map();
    this.primaryIcon = icon("play");
    this.primaryWords = h("span", { class: "label" });
    this.primary = h("button", { type: "button", class: "button primary dock-primary", onclick: () => this.give(this.offered.primary.verb, this.primary) }, this.primaryIcon, this.primaryWords);
    const order = (verb, iconName, more = {}) => button(t(`verb.${verb}`), iconName, { onclick: (event) => this.give(verb, event.currentTarget), ...more });
    this.stopRound = order("patrol-stop", "stop-round");
    this.takeoff = order("takeoff", "takeoff");
    this.goto = button(t("verb.goto"), "target", { "aria-pressed": "false", onclick: () => this.askPlace() });
    this.home = order("home", "home");
    this.land = order("land", "land");
    this.sticks = button(t("sticks.open"), "sticks", { "aria-pressed": "false", onclick: () => {
      this.setSheet(false);
      actions.sticks();
    } });
    this.automatic = h("input", { type: "checkbox", role: "switch", onchange: (event) => {
      const on = event.target.checked;
      event.target.checked = !on;
      this.give(on ? "automatic-on" : "automatic-off", event.target);
    } });
    this.automaticRow = h("label", { class: "switch dock-switch", title: t("order.automatic_hint") }, this.automatic, h("span", {}, t("order.automatic")));
    this.incident = button(t("incident.mark"), "alert", { onclick: () => this.askIncident() });
    this.cut = this.makeCut();
    this.stop = h("button", { type: "button", class: "stop", "aria-describedby": "stop-hint", onclick: (event) => this.give("stop", event.currentTarget) },
      icon("stop"), h("span", { class: "stop-words" }, h("strong", {}, t("order.stop")), h("small", { id: "stop-hint" }, t("order.stop_hint"))));
    this.toggle = button(t("order.more"), "more", { class: "dock-toggle", "aria-expanded": "false", "aria-controls": "dock-sheet", onclick: () => this.setSheet(this.sheet.dataset.open !== "true") });
    this.sheet = h("div", { class: "dock-sheet", id: "dock-sheet", data: { open: "false" } },
      h("div", { class: "dock-group" }, this.stopRound, this.takeoff, this.goto, this.home, this.land),
      h("div", { class: "dock-group" }, this.sticks, this.incident, this.automaticRow),
      h("div", { class: "dock-group dock-cut" }, this.cut));
    this.feedback = h("div", { class: "feedback", role: "status", "aria-live": "polite" });
    this.element = session.mayOrder
      ? h("section", { class: "dock", "aria-label": t("order.name") }, this.feedback, this.primary, this.sheet, this.toggle, this.stop)
      : h("section", { class: "dock viewer", "aria-label": t("order.name") }, h("p", { class: "quiet" }, icon("eye"), t("order.viewer")));
    this.onKey = (event) => {
      if (event.key === "Escape") this.setSheet(false);
    };
    this.element.addEventListener("keydown", this.onKey);
  }
  setSheet(open) {
    setData(this.sheet, "open", open);
    this.toggle.setAttribute("aria-expanded", String(open));
  }
  makeCut() {
    const hold = new Hold(CUT_HOLD_MS);
    const words = h("strong", {}, t("order.cut"));
    const element = h("button", { type: "button", class: "cut" }, h("span", { class: "cut-fill", "aria-hidden": "true" }), icon("cut"), h("span", { class: "cut-words" }, words, h("small", {}, t("order.cut_hint"))));
    // The style sheet shows how far it is: nothing is drawn here that would make the cut later.
    const look = () => {
      if (hold.since === null) return;
      const now = performance.now();
      if (hold.look(now)) this.give("cut", element);
      else if (!hold.done) setTimeout(look, Math.max(1, CUT_HOLD_MS * (1 - hold.progress(now))));
    };
    const press = () => {
      if (element.disabled || hold.since !== null) return;
      hold.press(performance.now());
      setData(element, "held", true);
      setTimeout(look, CUT_HOLD_MS);
    };
    const release = () => {
      hold.release();
      setData(element, "held", false);
    };
    element.style.setProperty("--hold-time", `${CUT_HOLD_MS}ms`);
    element.addEventListener("pointerdown", (event) => {
      event.preventDefault();
      element.setPointerCapture(event.pointerId);
      element.focus({ preventScroll: true });
      press();
    });
    for (const kind of ["pointerup", "pointercancel", "lostpointercapture", "blur"]) element.addEventListener(kind, release);
    element.addEventListener("keydown", (event) => {
      if (event.code !== "Space" && event.code !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) press();
    });
    element.addEventListener("keyup", release);
    element.addEventListener("contextmenu", (event) => event.preventDefault());
    return element;
  }
  /** Says something that is no answer to an order. */
  note(words) {
    const row = h("p", { class: "feedback-row", data: { outcome: "refused" } }, icon("alert"), h("span", {}, words),
      h("button", { type: "button", class: "icon-button", "aria-label": t("app.close"), onclick: () => row.remove() }, icon("cross")));
    this.feedback.append(row);
    while (this.feedback.children.length > 3) this.feedback.firstElementChild.remove();
    setTimeout(() => row.remove(), REFUSED_MS);
  }
  /** Gives an order and shows it pending, then what came of it. */
  async give(verb, control, more = {}) {
    // On its way before anything is drawn.
    const answer = this.session.order(verb, more);
    this.setSheet(false);
    const name = verb === "patrol-start" && this.offered?.primary.key === "order.resume" ? t("order.resume") : t(`verb.${verb}`);
    const row = h("p", { class: "feedback-row", data: { outcome: "pending" } }, h("span", { class: "spinner", "aria-hidden": "true" }), h("span", {}, t("answer.pending", { order: name })));
    this.feedback.append(row);
    while (this.feedback.children.length > 3) this.feedback.firstElementChild.remove();
    if (control) setData(control, "pending", true);
    const { outcome, text } = await answer;
    if (control) setData(control, "pending", false);
    setData(row, "outcome", outcome);
    const words = outcome === "accepted" ? t("answer.accepted", { order: name }) : outcome === "refused" ? sentence(text) || t("answer.refused") : t(`answer.${outcome}`);
    const close = h("button", { type: "button", class: "icon-button", "aria-label": t("app.close"), onclick: () => row.remove() }, icon("cross"));
    fill(row, icon(outcome === "accepted" ? "check" : "alert"), h("span", {}, outcome === "accepted" ? words : h("strong", {}, `${name}: `), outcome === "accepted" ? null : words), close);
    setTimeout(() => row.remove(), outcome === "accepted" ? ACCEPTED_MS : REFUSED_MS);
    return outcome;
  }
  askPlace() {
    this.setSheet(false);
    if (this.plan.asking) return this.endPlace();
    this.goto.setAttribute("aria-pressed", "true");
    this.plan.askPlace((place) => {
      if (!place) return this.endPlace();
      this.plan.asking.place = place;
      this.plan.dirty = true;
      const room = roomAt(this.session.about?.rooms ?? [], place.x_m, place.y_m);
      const where = `${room ? `${room} · ` : ""}${number(place.x_m, 1)} m, ${number(place.y_m, 1)} m`;
      const go = button(t("goto.go"), "target", { class: "primary", onclick: async () => {
        this.endPlace();
        const outcome = await this.give("goto", this.goto, { x_m: round(place.x_m), y_m: round(place.y_m) });
        if (outcome === "accepted") this.plan.setTarget(place);
      } });
      fill(this.plan.pick, h("span", {}, t("goto.ask", { where })), go, button(t("app.cancel"), null, { onclick: () => this.endPlace() }));
      go.focus();
    });
    return null;
  }
  endPlace() {
    this.goto.setAttribute("aria-pressed", "false");
    this.plan.endAsking();
  }
  askIncident() {
    this.setSheet(false);
    const seconds = this.keeps?.keeps ? this.keeps.rolling_s ?? 0 : 0;
    openDialog(t("incident.mark"), (close) => form([
      h("p", { class: "quiet" }, t("incident.words")),
      h("label", { class: "field" }, h("span", {}, t("incident.what")), h("textarea", { class: "input", name: "text", rows: 3, maxlength: 1000, autofocus: true })),
      seconds > 0 ? h("label", { class: "switch" }, h("input", { type: "checkbox", name: "keep", checked: true }), h("span", {}, t("incident.pictures", { seconds }))) : null,
    ], t("incident.keep"), async ({ text, keep }) => {
      const marked = await api.markIncident(this.session.drone, text.trim(), keep !== undefined);
      close();
      if (marked?.trouble) this.note(t("incident.no_pictures", { why: sentence(marked.trouble) }));
    }, [button(t("app.cancel"), null, { class: "plain", onclick: close })]), { modal: false });
  }
  update() {
    if (!this.session.mayOrder) return;
    const { pilot, patrol, control } = this.session;
    const offered = offers(pilot, patrol);
    this.offered = offered;
    setText(this.primaryWords, t(offered.primary.key));
    setIcon(this.primaryIcon, offered.primary.verb === "patrol-pause" ? "pause" : "play");
    this.primary.disabled = !offered.primaryReady;
    show(this.stopRound, offered.stopRound);
    show(this.takeoff, offered.takeoff);
    show(this.goto, !offered.takeoff);
    this.goto.disabled = !offered.goto;
    this.home.disabled = !offered.home;
    this.land.disabled = !offered.land;
    this.cut.disabled = !offered.cut;
    show(this.automaticRow, offered.automatic !== null);
    if (this.automatic.dataset.pending !== "true") this.automatic.checked = offered.automatic === true;
    this.sticks.setAttribute("aria-pressed", String(Boolean(control?.open)));
    if (this.plan.target && patrol && patrol.state !== 8 && !this.going) this.going = performance.now();
    if (patrol?.state === 8) this.going = null;
    if (this.plan.target && this.going && performance.now() - this.going > 3000) {
      this.plan.setTarget(null);
      this.going = null;
    }
  }
}

function round(value) {
  return Math.round(value * 1000) / 1000;
}
