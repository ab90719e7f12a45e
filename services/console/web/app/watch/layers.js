// The switch for each layer of the plan, with what its signs mean.

import { h, iconButton } from "../view/dom.js";
import { menu } from "../view/frame.js";
import { t } from "../words/text.js";
import { LAYERS } from "./session.js";

export function layersMenu(session) {
  const rows = Object.keys(LAYERS).map((name) => h("label", { class: "switch layer", data: { name } },
    h("input", { type: "checkbox", role: "switch", checked: session.layers.has(name), onchange: (event) => session.setLayer(name, event.target.checked) }),
    h("span", {}, t(`layer.${name}`), h("small", {}, t(`layer_hint.${name}`)))));
  return menu(iconButton(t("layer.name"), "layers"), h("div", { class: "layers", role: "group", "aria-label": t("layer.name") }, rows), { class: "menu layers-menu" });
}
