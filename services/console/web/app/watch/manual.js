// Manual control as it is shown: taking and releasing, what the drone does with it, the sticks, the switches.

import { CHANNELS } from "../pure/mapping.js";
import { h, button, fill, icon, iconButton, setData, setText, show } from "../view/dom.js";
import { sentence } from "../words/sentences.js";
import { number, t } from "../words/text.js";
import { wizardDialog } from "./wizard.js";

const TONE = { free: "info", stopping: "info", neutral: "caution", ready: "ok", following: "lamp", silent: "alarm" };

export class ManualPanel {
  constructor(session, done) {
    this.session = session;
    this.control = session.control;
    const { touch } = this.control;
    touch.forget();
    this.state = h("strong", {});
    this.hint = h("p", { class: "quiet" });
    this.stateBox = h("div", { class: "sticks-state", role: "status", "aria-live": "polite" }, h("span", { class: "dot", "aria-hidden": "true" }), h("div", {}, this.state, this.hint));
    this.take = button(t("sticks.take"), "hand", { class: "primary sticks-take", onclick: () => this.control.take() });
    this.release = button(t("sticks.release"), "out", { class: "sticks-release", onclick: () => this.control.release() });
    this.trouble = h("p", { class: "note bad", role: "alert", hidden: true });
    this.device = h("div", { class: "device" });
    this.bars = h("div", { class: "channels" });
    this.hold = touch.holdButton(t("sticks.hold"), t("sticks.hold_hint"));
    const left = touch.stick("left", t("sticks.left"), { up: t("sticks.up"), down: t("sticks.down"), left: "↺", right: "↻" });
    const right = touch.stick("right", t("sticks.right"), { up: t("sticks.forward"), down: t("sticks.back"), left: "←", right: "→" });
    const toggle = (name) => h("label", { class: "switch" },
      h("input", { type: "checkbox", role: "switch", checked: this.control.switches[name], onchange: (event) => this.control.setSwitch(name, event.target.checked) }), h("span", {}, t(`sticks.${name}`)));
    this.element = h("section", { class: "panel manual", "aria-labelledby": "manual-name" },
      h("header", { class: "panel-head" }, icon("sticks"), h("h2", { id: "manual-name" }, t("sticks.name")), iconButton(t("sticks.close"), "cross", { onclick: done })),
      this.stateBox, this.trouble, this.take,
      h("div", { class: "touch-sticks" }, left, this.hold, right),
      this.release,
      this.device, this.bars,
      h("div", { class: "sticks-switches" }, toggle("height_hold"), toggle("heading_hold")),
      h("details", { class: "keys" }, h("summary", {}, t("sticks.keyboard")), h("dl", {},
        [["W S", "keys.forward"], ["A D", "keys.side"], ["↑ ↓", "keys.up"], ["← →", "keys.turn"], [t("keys.space_name"), "keys.space"], ["Esc", "keys.escape"]]
          .map(([keys, words]) => [h("dt", {}, h("kbd", {}, keys)), h("dd", {}, t(words))]))));
    this.shownPad = undefined;
    this.onChange = () => this.update(performance.now());
    this.control.addEventListener("change", this.onChange);
  }
  update(now) {
    const { control } = this;
    const { pilot } = this.session;
    const lease = control.hasLease;
    const state = lease ? control.sticksState : "free";
    const other = control.otherHolder;
    const frozen = control.open ? control.liveness.frozen(now) : null;
    const dead = frozen !== null && (lease || frozen !== "silent");
    setData(this.stateBox, "tone", dead ? "caution" : TONE[state] ?? "info");
    setData(this.stateBox, "frozen", frozen ?? "");
    setText(this.state, other ? t("sticks.other", { holder: other }) : t(`sticks.state.${state}`));
    const age = lease && Number.isFinite(pilot?.sticks_age_ms) ? ` · ${t("sticks.age", { age: number(pilot.sticks_age_ms) })}` : "";
    setText(this.hint, `${t(dead ? `frozen.${frozen}` : other ? "sticks.hint.other" : `sticks.hint.${state}`)}${age}`);
    show(this.take, !lease);
    this.take.disabled = control.asked !== null || !control.socket?.open;
    setData(this.take, "pending", control.asked !== null);
    show(this.release, lease);
    const refused = control.answer && control.answer.outcome !== "accepted" && !lease;
    show(this.trouble, Boolean(refused));
    if (refused) setText(this.trouble, sentence(control.answer.text) || t(`answer.${control.answer.outcome}`));
    if (lease && this.element.dataset.lease === "false" && this.element.contains(document.activeElement)) this.hold.focus({ preventScroll: true });
    setData(this.element, "lease", lease);
    setData(this.hold, "live", state);
    this.showPad();
  }
  showPad() {
    const { pads } = this.control;
    const pad = pads.device;
    const { unfit } = pads;
    const key = pad ? `${pad.index}${pad.id}` : unfit ? `!${unfit.id}` : null;
    if (key !== this.shownPad) {
      this.shownPad = key;
      this.drawDevice(pad, unfit);
    }
    if (pad) this.drawBars(pad);
  }
  drawDevice(pad, unfit) {
    fill(this.bars);
    this.rows = null;
    if (pad) {
      fill(this.device, icon("sticks"), h("div", {}, h("strong", {}, nameOf(pad.id)), h("span", { class: "quiet" }, t(pad.mapping === "standard" ? "pad.gamepad" : "pad.radio", { axes: pad.axes.length }))),
        button(t("pad.set_up"), null, { onclick: () => wizardDialog(this.control, pad) }));
    } else if (unfit) {
      fill(this.device, h("p", { class: "note bad" }, icon("alert"), h("span", {}, t("pad.few_axes", { name: nameOf(unfit.id), have: unfit.have, need: unfit.need }))));
    } else fill(this.device, icon("sticks"), h("p", { class: "quiet" }, t("pad.none")));
  }
  drawBars(pad) {
    const { mapping } = this.control.pads;
    if (!mapping) return;
    const named = [...CHANNELS, "hold"].filter((channel) => mapping[channel]);
    const drawn = named.join();
    if (!this.rows || this.rowsOf !== drawn) {
      this.rowsOf = drawn;
      this.rows = named.map((channel) => {
        const bar = h("span", { class: "channel-bar" }, h("span", { class: "channel-fill" }));
        return { channel, bar, element: h("li", {}, h("span", {}, t(`channel.${channel}`)), bar) };
      });
      fill(this.bars, h("ul", { "aria-label": t("pad.channels") }, this.rows.map((row) => row.element)));
    }
    for (const { channel, bar } of this.rows) {
      const input = mapping[channel];
      const value = Number.isInteger(input.axis) ? (pad.axes[input.axis] ?? 0) * input.sign : pad.buttons[input.button]?.pressed ? 1 : 0;
      bar.style.setProperty("--value", Math.max(-1, Math.min(1, value)).toFixed(3));
      setData(bar, "on", Number.isInteger(input.button) && value > 0);
    }
  }
  end() {
    this.control.removeEventListener("change", this.onChange);
    this.control.touch.forget();
  }
}

/** A device's name without the numbers that browsers add. */
export function nameOf(id) {
  return id.replace(/\s*\(.*?(vendor|product|standard).*?\)\s*/gi, "").replace(/^[0-9a-f]{4}-[0-9a-f]{4}-/i, "").trim() || id;
}
