// The wizard: one stick after the other is moved, and the page learns which axis is which.

import { recognise, defaultMapping } from "../pure/mapping.js";
import { STEPS, Wizard } from "../pure/wizard.js";
import { h, button, icon, setData, setText, show } from "../view/dom.js";
import { openDialog } from "../view/dialog.js";
import { t } from "../words/text.js";
import { nameOf } from "./manual.js";

export function wizardDialog(control, pad) {
  const wizard = new Wizard();
  const title = h("h3", {});
  const words = h("p", { class: "quiet" });
  const steps = h("ol", { class: "wizard-steps" }, STEPS.map((step) => h("li", { data: { step } }, h("span", { class: "wizard-sign" }, icon("check")), t(`channel.${step}`))));
  const axes = h("div", { class: "wizard-axes", "aria-hidden": "true" }, pad.axes.map(() => h("span", { class: "channel-bar" }, h("span", { class: "channel-fill" }))));
  const skip = button(t("wizard.skip"), null, { onclick: () => wizard.skip() });
  let timer = null;
  const close = openDialog(t("wizard.title", { name: nameOf(pad.id) }), (shut) => {
    const keep = button(t("wizard.keep"), "check", { class: "primary", onclick: () => {
      control.pads.keep(pad, wizard.mapping);
      shut();
    } });
    const standard = button(t("wizard.default"), null, { class: "plain", onclick: () => {
      control.pads.keep(pad, defaultMapping(pad));
      shut();
    } });
    const body = h("div", { class: "form wizard" }, h("div", { role: "status", "aria-live": "polite" }, title, words), axes, steps, h("div", { class: "dialog-actions" }, standard, skip, keep));
    const work = () => {
      if (!body.isConnected && timer !== null && work.begun) {
        clearInterval(timer);
        return;
      }
      work.begun = body.isConnected;
      const device = control.pads.list().find((one) => one.index === pad.index);
      if (!device || recognise(device).error) {
        setText(title, t("wizard.gone"));
        setText(words, "");
        return;
      }
      wizard.sample(device, performance.now());
      [...axes.children].forEach((bar, k) => bar.style.setProperty("--value", Math.max(-1, Math.min(1, device.axes[k] ?? 0)).toFixed(3)));
      setText(title, wizard.done ? t("wizard.done") : t(wizard.phase === "rest" ? "wizard.rest" : `wizard.${wizard.step}`));
      setText(words, wizard.done ? t("wizard.done_words") : t(wizard.phase === "rest" ? "wizard.rest_words" : "wizard.move_words"));
      show(skip, wizard.maySkip);
      show(keep, wizard.done);
      for (const item of steps.children) {
        const at = STEPS.indexOf(item.dataset.step);
        setData(item, "state", at < wizard.at ? (wizard.mapping[item.dataset.step] ? "done" : "skipped") : at === wizard.at ? "now" : "next");
      }
    };
    timer = setInterval(work, 30);
    work();
    return body;
  }, { modal: false });
  return close;
}
