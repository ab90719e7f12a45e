// The round room by room, and everything on the plan as lists: what can be done with a pointer can be done here with keys.

import { itemsOf, leftOut, lowered, raised, sections, shortest } from "../pure/building.js";
import { h, button, fill, icon, iconButton } from "../view/dom.js";
import { t } from "../words/text.js";
import { kindIcon } from "./inspector.js";

/** Keeps the focus where it was when a list is made anew: by the name of the button and of its row. */
function refill(element, ...children) {
  const key = document.activeElement?.dataset?.key;
  const inside = key && element.contains(document.activeElement);
  fill(element, ...children);
  if (!inside) return;
  const found = [...element.querySelectorAll("[data-key]")].find((one) => one.dataset.key === key && !one.disabled);
  (found ?? [...element.querySelectorAll("[data-key]")].find((one) => one.dataset.key.split("|")[1] === key.split("|")[1] && !one.disabled))?.focus();
}

export class OrderList {
  constructor(desk) {
    this.desk = desk;
    this.list = h("div", {});
    this.short = button(t("edit.shortest"), "auto", { class: "plain", onclick: () => desk.edit(shortest(desk.building)) });
    this.element = h("section", { class: "panel order" }, h("div", { class: "panel-head" }, icon("list"), h("h2", {}, t("edit.order")), this.short), this.list);
  }
  update() {
    const { desk } = this;
    const { first, rest, out } = sections(desk.building);
    this.short.hidden = !desk.may || first.length === 0;
    if (desk.building.rooms.length === 0) {
      fill(this.list, h("p", { class: "quiet small" }, t("edit.no_rooms")));
      return;
    }
    const row = (name, place) => {
      const isOut = place === "out";
      const number = typeof place === "number" ? String(place + 1) : "";
      const edit = (change) => () => desk.edit(change(desk.building, name));
      const select = () => desk.select({ kind: "rooms", index: desk.building.rooms.findIndex((room) => room.name === name) });
      return h("li", { data: { place: isOut ? "out" : number ? "first" : "rest" } },
        h("span", { class: "order-number", "aria-hidden": "true" }, number || (isOut ? "–" : "·")),
        h("button", { type: "button", class: "row-name", onclick: select, data: { key: `name|${name}` } }, name),
        desk.may ? h("span", { class: "row-tools" },
          iconButton(t("edit.up", { room: name }), "up", { onclick: edit(raised), disabled: isOut || place === 0, data: { key: `up|${name}` } }),
          iconButton(t("edit.down", { room: name }), "down", { onclick: edit(lowered), disabled: typeof place !== "number", data: { key: `down|${name}` } }),
          iconButton(t(isOut ? "edit.take_in" : "edit.leave_out", { room: name }), isOut ? "plus" : "skip", { onclick: () => desk.edit(leftOut(desk.building, name, !isOut)), data: { key: `out|${name}` } })) : null);
    };
    const part = (title, names, place) => (names.length === 0 ? null : [h("h3", {}, title), h("ol", { class: "rows" }, names.map((name, k) => row(name, place ?? k)))]);
    refill(this.list,
      part(t("edit.order_first"), first),
      part(t(first.length > 0 ? "edit.order_rest" : "edit.order_all"), rest, "rest"),
      part(t("edit.order_out"), out, "out"));
  }
}

/** All points, zones, doors and rooms; one list a kind, folded away where there is nothing. */
export class ThingsList {
  constructor(desk, kinds) {
    this.desk = desk;
    this.kinds = kinds;
    this.list = h("div", {});
    this.element = h("section", { class: "panel things" }, h("div", { class: "panel-head" }, icon("layers"), h("h2", {}, t("edit.things"))), this.list);
  }
  update() {
    const { desk } = this;
    const row = (kind, item, index) => h("li", { data: { selected: String(desk.selected?.kind === kind && desk.selected.index === index) } },
      kindIcon(kind),
      h("button", { type: "button", class: "row-name", onclick: () => desk.select({ kind, index }), data: { key: `select|${kind} ${index}` } }, item.name),
      desk.may ? h("span", { class: "row-tools" }, iconButton(t("edit.delete_named", { name: item.name }), "bin", { onclick: () => desk.remove({ kind, index }), data: { key: `bin|${kind} ${index}` } })) : null);
    const parts = this.kinds.map((kind) => {
      const items = itemsOf(desk.building, kind);
      return items.length === 0 ? null : [h("h3", {}, t(`edit.many.${kind}`)), h("ul", { class: "rows" }, items.map((item, k) => row(kind, item, k)))];
    });
    refill(this.list, parts.some(Boolean) ? parts : h("p", { class: "quiet small" }, t("edit.nothing")));
  }
}
