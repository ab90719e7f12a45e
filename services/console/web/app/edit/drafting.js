// A picture becomes a plan, step by step: scale, walls, pad, rooms and doors, check.

import { DOOR_M, growth } from "../pure/drafting.js";
import { h, button, fill, icon, setText, show } from "../view/dom.js";
import { openDialog } from "../view/dialog.js";
import { form, trouble } from "../view/form.js";
import { number, t } from "../words/text.js";

/** Largest file that the console takes. */
const MOST_BYTES = 16 * 1024 * 1024;

/** Takes in a file; what is wrong is shown where `place` is. */
async function take(desk, file, place) {
  if (!file) return;
  if (file.size > MOST_BYTES) {
    fill(place, h("p", { class: "note bad" }, icon("alert"), h("span", {}, t("draft.too_large"))));
    return;
  }
  fill(place, h("p", { class: "quiet small", role: "status" }, t("draft.sending")));
  try {
    await desk.upload(file);
    fill(place);
  } catch (error) {
    fill(place, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
  }
}

/** Where a file is chosen or dropped. */
export function uploadPanel(desk) {
  const place = h("div", { role: "alert" });
  const input = h("input", { type: "file", accept: "image/png,image/jpeg", class: "unseen", id: "draft-file", onchange: () => take(desk, input.files[0], place) });
  const drop = h("label", { class: "drop", for: "draft-file" }, icon("upload"), h("strong", {}, t("draft.choose")), h("small", {}, t("draft.choose_hint")));
  const over = (on) => (event) => {
    event.preventDefault();
    drop.dataset.over = String(on);
  };
  drop.addEventListener("dragover", over(true));
  drop.addEventListener("dragleave", over(false));
  drop.addEventListener("drop", (event) => {
    over(false)(event);
    take(desk, event.dataTransfer.files[0], place);
  });
  return h("section", { class: "panel upload" }, h("div", { class: "panel-head" }, icon("upload"), h("h2", {}, t("draft.title"))), h("p", { class: "quiet small" }, t("draft.words")), input, drop, place);
}

/** Asks how far two places are from each other. */
export function askDistance(desk, a, b, done) {
  openDialog(t("draft.distance"), (close) => form([
    h("p", { class: "quiet" }, t("draft.distance_words")),
    h("label", { class: "field" }, h("span", {}, t("draft.metres")), h("input", { class: "input", name: "metres", type: "number", min: 0.1, max: 1000, step: 0.01, required: true, value: String(DOOR_M) })),
  ], t("draft.measure"), async ({ metres }) => {
    const ratio = growth(desk.reading, a, b, Number(metres));
    if (ratio === null) throw Object.assign(new Error(t("draft.no_scale")), { status: 400 });
    desk.measure(ratio);
    close();
    done();
  }, [button(t("app.cancel"), null, { class: "plain", onclick: close })]));
}

export class DraftPanel {
  constructor(desk, canvas) {
    this.desk = desk;
    this.canvas = canvas;
    this.size = h("p", { class: "quiet small" });
    this.slider = h("input", { type: "range", class: "range", min: 1, max: 255, step: 1, "aria-label": t("draft.threshold"), oninput: () => desk.read({ dark_below: this.slider.valueAsNumber }, "threshold") });
    this.mended = h("p", { class: "quiet small" });
    this.trouble = h("div", { role: "alert" });
    this.make = button(t("draft.make"), "check", { class: "primary", onclick: () => this.check() });
    this.said = h("p", { class: "note good" });
    this.which = h("div", { class: "segments", role: "group", "aria-label": t("draft.which") }, ["picture", "plan"].map((what) => h("button", { type: "button", onclick: () => {
      canvas.show(what === "plan");
      this.update();
    }, data: { what } }, t(`draft.show_${what}`))));
    this.steps = ["scale", "walls", "pad", "rooms", "check"].map((name) => h("li", { data: { step: name } }, h("h3", {}, t(`draft.step.${name}`)), h("p", { class: "quiet small" }, t(`draft.step_words.${name}`)), this.inside(name)));
    this.element = h("section", { class: "panel draft" },
      h("div", { class: "panel-head" }, icon("upload"), h("h2", {}, t("draft.title")), button(t("draft.back"), null, { class: "plain", onclick: () => this.leave() })),
      h("ol", { class: "steps" }, this.steps));
  }
  inside(name) {
    const { desk } = this;
    const tool = (kind, iconName, shape) => button(t(`edit.tool.${kind}`), iconName, { onclick: () => {
      this.canvas.show(false);
      desk.setTool(kind, shape);
      this.canvas.canvas.focus({ preventScroll: true });
    }, data: { tool: kind } });
    if (name === "scale") return [this.size, h("div", { class: "step-tools" }, tool("scale", "ruler"))];
    if (name === "walls") return [this.slider, this.mended, h("div", { class: "step-tools" }, tool("walls", "wall"), tool("wiped", "eraser"))];
    if (name === "pad") return h("div", { class: "step-tools" }, tool("pad", "home"));
    if (name === "rooms") return h("div", { class: "step-tools" }, tool("rooms", "rooms", "rectangle"), tool("doors", "door"));
    return [this.trouble, this.said, h("div", { class: "step-tools" }, this.make, this.which)];
  }
  leave() {
    if (!this.desk.unsaved || confirm(t("edit.leave"))) this.desk.forget();
    if (!this.desk.draft) this.desk.load();
  }
  async check() {
    this.make.disabled = true;
    fill(this.trouble);
    try {
      await this.desk.make();
      await this.canvas.loadMade();
    } catch (error) {
      fill(this.trouble, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    }
    this.make.disabled = false;
    this.update();
  }
  update() {
    const { desk } = this;
    const { draft, reading, building, made } = desk;
    if (!draft) return;
    const done = { scale: reading.measured, walls: reading.measured, pad: building.pad !== null, rooms: building.rooms.length > 0, check: desk.isMade };
    for (const step of this.steps) step.dataset.done = String(done[step.dataset.step]);
    const scale = reading.metres_per_pixel;
    setText(this.size, reading.measured ? t("draft.size", { width: number(draft.width * scale, 1), height: number(draft.height * scale, 1) }) : t("draft.not_measured"));
    if (this.slider.valueAsNumber !== reading.dark_below) this.slider.value = String(reading.dark_below);
    setText(this.mended, reading.walls.length + reading.wiped.length > 0 ? t("draft.mended", { walls: reading.walls.length, wiped: reading.wiped.length }) : "");
    show(this.said, desk.isMade);
    if (desk.isMade) fill(this.said, icon("check"), h("span", {}, t("draft.made", { area: number(made.free_m2) })));
    show(this.which, desk.isMade);
    if (!desk.isMade && this.canvas.showsPlan) this.canvas.show(false);
    for (const choice of this.which.children) choice.setAttribute("aria-pressed", String((choice.dataset.what === "plan") === this.canvas.showsPlan));
    for (const one of this.element.querySelectorAll("[data-tool]")) one.setAttribute("aria-pressed", String(one.dataset.tool === desk.tool));
    this.make.disabled = !reading.measured || building.pad === null;
  }
}
