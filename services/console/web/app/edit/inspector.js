// What is selected on the plan: its name, where it is, which way the pad looks; and away with it.

import { cm, nameTrouble } from "../pure/building.js";
import { h, button, fill, icon, setText } from "../view/dom.js";
import { t } from "../words/text.js";

const ICONS = { points: "target", pad: "home", doors: "door", rooms: "rooms", no_fly: "shield", privacy: "video-off" };

export function kindIcon(kind) {
  return icon(ICONS[kind] ?? "list");
}

function number(label, value, properties, change) {
  return h("label", { class: "field" }, h("span", {}, label), h("input", { class: "input", type: "number", inputmode: "decimal", value: String(value), ...properties, onchange: (event) => {
    const next = event.target.valueAsNumber;
    if (Number.isFinite(next)) change(next);
  } }));
}

export class Inspector {
  constructor(desk) {
    this.desk = desk;
    this.element = h("section", { class: "panel inspector", "aria-live": "off", hidden: true });
    this.shown = null;
  }
  /** Makes the fields of what is selected now. */
  select() {
    const { desk } = this;
    const { selected } = desk;
    const item = desk.item();
    this.element.hidden = item === null;
    this.shown = selected;
    this.place = null;
    if (!item) {
      fill(this.element);
      return;
    }
    const { kind, index } = selected;
    const off = !desk.may;
    const trouble = h("small", { class: "bad-words", role: "alert" });
    const name = kind === "pad" ? null : h("label", { class: "field" }, h("span", {}, t("edit.name")),
      h("input", { class: "input", value: item.name, maxlength: 31, disabled: off, autocomplete: "off", oninput: (event) => {
        const plain = event.target.value.trim();
        const wrong = nameTrouble(desk.building, kind, index, plain);
        setText(trouble, wrong ? t(`edit.name_${wrong}`) : "");
        if (!wrong) desk.replace(selected, { ...desk.item(), name: plain }, `name ${kind} ${index}`);
      }, onblur: () => desk.history.settle() }), trouble);
    this.name = name?.querySelector("input") ?? null;
    const place = item.x === undefined ? null : h("div", { class: "pair" },
      number(t("edit.x"), item.x, { step: 0.05, disabled: off }, (x) => desk.replace(selected, { ...desk.item(), x: cm(x) })),
      number(t("edit.y"), item.y, { step: 0.05, disabled: off }, (y) => desk.replace(selected, { ...desk.item(), y: cm(y) })));
    this.place = place?.querySelectorAll("input") ?? null;
    const turn = kind !== "pad" ? null : h("label", { class: "field" }, h("span", {}, t("edit.heading")),
      h("input", { type: "range", min: 0, max: 345, step: 15, value: String((((item.heading_deg ?? 0) % 360) + 360) % 360), disabled: off, class: "range",
        oninput: (event) => desk.replace(selected, { ...desk.item(), heading_deg: event.target.valueAsNumber }, "turn") }));
    fill(this.element,
      h("div", { class: "panel-head" }, kindIcon(kind), h("h2", {}, t(`edit.one.${kind}`)), off ? null : button(t("edit.delete"), "bin", { class: "plain danger", onclick: () => desk.remove(selected) })),
      h("div", { class: "edit-fields" }, name, place, turn));
  }
  /** What is selected has been moved. */
  update() {
    const item = this.desk.item();
    if (this.shown !== this.desk.selected || (item === null) !== this.element.hidden) this.select();
    if (!item || !this.place) return;
    [item.x, item.y].forEach((value, k) => {
      const field = this.place[k];
      if (field && field !== document.activeElement && field.valueAsNumber !== value) field.value = String(value);
    });
  }
}
