// The plan on the desk: panned and zoomed, and with a tool in hand drawn on. Everything works with a pointer and with keys: arrows move
// the plan or what is selected, Enter clicks in the middle, Escape lets go.

import { draftPictureUrl, draftPlanUrl, planUrl } from "../net/api.js";
import { freshName, moved, polygon, rectangle, reshaped } from "../pure/building.js";
import { extent } from "../pure/drafting.js";
import { hit } from "../pure/hit.js";
import { Projection } from "../pure/projection.js";
import { fitCanvas } from "../view/canvas-size.js";
import { h, iconButton, setData, setText, show } from "../view/dom.js";
import { drawGround, drawScale } from "../watch/draw-plan.js";
import { loadGround } from "../watch/ground.js";
import { readPalette } from "../watch/palette.js";
import { t } from "../words/text.js";
import { PictureImage, drawBuilding, drawCross, drawPicture, drawStroke } from "./draw.js";

const CLICK_PX = 6;
const REACH_PX = 12;
/** Arrow keys move what is selected by so much, metres; with the shift key by more. */
const STEP_M = 0.05;
const STRIDE_M = 0.5;

/** How each tool draws: one place, two places, or the outline that is chosen. */
const FORMS = { points: "place", pad: "place", doors: "line", scale: "line", walls: "line", wiped: "rectangle" };

export class EditCanvas {
  constructor(desk, actions) {
    this.desk = desk;
    this.actions = actions;
    this.canvas = h("canvas", { class: "plan-canvas", tabindex: "0", role: "application", "aria-label": t("edit.canvas") });
    this.empty = h("p", { class: "plan-empty" }, t("plan.loading"));
    this.hint = h("div", { class: "plan-pick", hidden: true, role: "status" });
    this.tools = h("div", { class: "plan-tools", role: "group", "aria-label": t("plan.tools") },
      iconButton(t("plan.closer"), "plus", { onclick: () => this.zoom(1.35) }),
      iconButton(t("plan.farther"), "minus", { onclick: () => this.zoom(1 / 1.35) }),
      iconButton(t("plan.fit"), "fit", { onclick: () => this.fit() }));
    this.element = h("div", { class: "plan" }, this.canvas, this.empty, this.tools, this.hint);
    this.view = {
      session: { about: null, patrol: null, layers: new Set() }, projection: new Projection(), palette: readPalette(),
      context: this.canvas.getContext("2d"), ground: null, ratio: 1, em: 16,
    };
    this.picture = null;
    /** Whether the plan made of a draft is shown in place of its picture. */
    this.showsPlan = false;
    this.stroke = null;
    this.drag = null;
    this.pointers = new Map();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.element);
    this.onTheme = () => {
      this.view.palette = readPalette();
      this.redraw();
    };
    addEventListener("sereno:theme", this.onTheme);
    this.listen();
    this.load();
  }
  async load() {
    const { desk, view } = this;
    const turn = (this.turn = (this.turn ?? 0) + 1);
    try {
      let ground = null;
      let picture = null;
      if (desk.draft) {
        const image = new Image();
        image.src = draftPictureUrl(desk.drone, desk.draft.id);
        await image.decode();
        picture = new PictureImage(image);
        if (desk.isMade) ground = await this.madeGround();
      } else if (desk.about) ground = await loadGround(planUrl(desk.drone, desk.about.hash), desk.about);
      if (turn !== this.turn) return;
      view.ground = ground;
      this.picture = picture;
      this.showsPlan = false;
      show(this.empty, !ground && !picture);
      this.fit();
    } catch {
      if (turn !== this.turn) return;
      setText(this.empty, t("plan.missing"));
      show(this.empty, true);
    }
    this.redraw();
  }
  madeGround() {
    const { made, drone, draft } = this.desk;
    return loadGround(`${draftPlanUrl(drone, draft.id)}?at=${Date.now()}`, made);
  }
  /** The console has made a plan of the draft. */
  async loadMade() {
    try {
      this.view.ground = await this.madeGround();
      this.show(true);
    } catch {
      this.show(false);
    }
  }
  show(plan) {
    this.showsPlan = plan && this.view.ground !== null;
    this.redraw();
  }
  box() {
    const { desk, view } = this;
    if (desk.draft) return extent(desk.draft, desk.reading);
    return view.ground?.box ?? null;
  }
  resize() {
    if (!fitCanvas(this.view, this.canvas, this.element)) return;
    if (!this.touched) this.fit();
    // At once: what was cleared would be seen as a flash.
    this.draw();
  }
  fit() {
    const box = this.box();
    const { projection, em } = this.view;
    if (!box) return;
    const narrow = projection.width < 640;
    projection.least = 0.2;
    projection.fit(box, { top: 1.2 * em, right: (narrow ? 1 : 4.6) * em, bottom: (narrow ? 4 : 2.4) * em, left: (narrow ? 1 : 1.6) * em });
    projection.least = projection.scale * 0.5;
    this.touched = false;
    this.redraw();
  }
  zoom(factor, x, y) {
    this.view.projection.zoom(factor, x, y);
    this.touched = true;
    this.redraw();
  }
  /** Begins anew with the tool that is in hand. */
  begin() {
    const { tool, shape } = this.desk;
    this.stroke = tool === "select" ? null : { kind: tool, form: FORMS[tool] ?? shape, places: [], over: null };
    const words = tool === "select" ? "" : this.stroke.form === "place" ? t("edit.hint.place") : this.stroke.form === "line" ? t("edit.hint.line") : this.stroke.form === "rectangle" ? t("edit.hint.rectangle") : t("edit.hint.polygon");
    setText(this.hint, words);
    show(this.hint, words !== "");
    setData(this.element, "asking", String(tool !== "select"));
    this.redraw();
  }
  /** A click of a tool at a place. */
  put(place, closes = false) {
    const { stroke } = this;
    const reach = REACH_PX / this.view.projection.scale;
    if (stroke.form === "place") return this.done(stroke.kind, [place]);
    if (stroke.form === "polygon") {
      const [first] = stroke.places;
      const back = first && Math.hypot(first.x_m - place.x_m, first.y_m - place.y_m) < reach;
      if ((closes || back) && stroke.places.length >= 3) return this.done(stroke.kind, stroke.places);
      if (!back) stroke.places.push(place);
    } else {
      stroke.places.push(place);
      if (stroke.places.length === 2) return this.done(stroke.kind, stroke.places);
    }
    this.redraw();
  }
  done(kind, places) {
    const { desk } = this;
    const [a, b] = places;
    const small = places.length === 2 && Math.hypot(a.x_m - b.x_m, a.y_m - b.y_m) * this.view.projection.scale < CLICK_PX;
    const form = this.stroke.form;
    this.begin();
    if (small) return;
    if (kind === "scale") {
      this.actions.measured(a, b);
      return;
    }
    if (kind === "walls" || kind === "wiped") {
      desk.read({ [kind]: [...desk.reading[kind], [a.x_m, a.y_m, b.x_m, b.y_m]] });
      return;
    }
    desk.setTool("select");
    if (kind === "pad") {
      desk.replace({ kind: "pad", index: 0 }, { heading_deg: 0, ...desk.building.pad, ...moved({ x: 0, y: 0 }, a.x_m, a.y_m) });
      desk.select({ kind: "pad", index: 0 });
      return;
    }
    const name = freshName(desk.building, kind, t(`edit.base.${kind}`));
    if (kind === "points") desk.add(kind, { name, ...moved({ x: 0, y: 0 }, a.x_m, a.y_m) });
    else if (kind === "doors") desk.add(kind, { name, ...moved({ a: [a.x_m, a.y_m], b: [b.x_m, b.y_m] }, 0, 0) });
    else desk.add(kind, { name, ...(form === "polygon" ? polygon(places) : rectangle(a, b)) });
    this.actions.added();
  }
  listen() {
    const { canvas, pointers, desk } = this;
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      const at = local(event);
      pointers.set(event.pointerId, { ...at, moved: 0 });
      if (pointers.size > 1) {
        this.drag = null;
        return;
      }
      const place = this.view.projection.place(at.x, at.y);
      const coarse = event.pointerType === "touch" ? 1.8 : 1;
      if (this.stroke) {
        if (this.stroke.form === "rectangle" && this.stroke.places.length === 0) this.stroke.start = place;
      } else {
        const found = hit(desk.building, place.x_m, place.y_m, (coarse * REACH_PX) / this.view.projection.scale, desk.selected);
        this.drag = { found, place, item: found && desk.may ? desk.item(found) : null };
      }
    });
    canvas.addEventListener("pointermove", (event) => this.move(event, local(event)));
    const up = (event) => {
      const pointer = pointers.get(event.pointerId);
      pointers.delete(event.pointerId);
      const { drag } = this;
      this.drag = null;
      if (event.type !== "pointerup" || !pointer) return;
      const place = this.view.projection.place(pointer.x, pointer.y);
      const click = pointer.moved <= CLICK_PX;
      if (this.stroke) {
        const { start } = this.stroke;
        this.stroke.start = null;
        if (click) this.put(place, event.detail > 1);
        else if (start && pointers.size === 0) {
          this.stroke.places = [start];
          this.put(place);
        }
      } else if (click) desk.select(drag?.found ? { kind: drag.found.kind, index: drag.found.index } : null);
      else desk.history.settle();
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("dblclick", () => {
      if (this.stroke?.form === "polygon" && this.stroke.places.length >= 3) this.done(this.stroke.kind, this.stroke.places);
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const { x, y } = local(event);
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), x, y);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("focus", () => this.redraw());
    canvas.addEventListener("blur", () => this.redraw());
  }
  move(event, now) {
    const { pointers, desk } = this;
    const { projection } = this.view;
    const before = pointers.get(event.pointerId);
    const place = projection.place(now.x, now.y);
    if (this.stroke && pointers.size <= 1) {
      const { places, start, form } = this.stroke;
      this.stroke.over = places.length > 0 || start ? place : null;
      if (start && before && form === "rectangle" && before.moved > CLICK_PX) this.stroke.places = [start];
    }
    if (before) {
      before.moved += Math.hypot(now.x - before.x, now.y - before.y);
      if (pointers.size === 2) this.pinch(event.pointerId, before, now);
      else if (before.moved > CLICK_PX) this.dragTo(place, now.x - before.x, now.y - before.y);
      Object.assign(before, now);
    } else if (!this.stroke) {
      const found = desk.may && hit(desk.building, place.x_m, place.y_m, REACH_PX / projection.scale, desk.selected);
      setData(this.element, "over", String(Boolean(found)));
    }
    this.redraw();
  }
  pinch(id, before, now) {
    const other = [...this.pointers.entries()].find(([key]) => key !== id)[1];
    const was = Math.hypot(before.x - other.x, before.y - other.y);
    const is = Math.hypot(now.x - other.x, now.y - other.y);
    if (was > 10 && is > 10) this.zoom(is / was, (now.x + other.x) / 2, (now.y + other.y) / 2);
    this.view.projection.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
    other.moved = CLICK_PX + 1;
    if (this.stroke) Object.assign(this.stroke, { start: null, places: this.stroke.form === "rectangle" ? [] : this.stroke.places });
  }
  dragTo(place, dx, dy) {
    const { drag, desk } = this;
    if (this.stroke) {
      if (!this.stroke.start) this.pan(dx, dy);
      return;
    }
    const chosen = drag?.found && desk.selected && drag.found.kind === desk.selected.kind && drag.found.index === desk.selected.index;
    // Rooms are large: they are selected before they are carried, so that a plan can be panned by them.
    const carries = drag?.item && (chosen || drag.found.kind !== "rooms");
    if (!carries) {
      this.pan(dx, dy);
      return;
    }
    if (!chosen) desk.select({ kind: drag.found.kind, index: drag.found.index });
    const tag = `drag ${drag.found.kind} ${drag.found.index}`;
    const item = drag.found.corner === null ? moved(drag.item, place.x_m - drag.place.x_m, place.y_m - drag.place.y_m) : reshaped(desk.item(drag.found), drag.found.corner, place.x_m, place.y_m);
    desk.replace(drag.found, item, tag);
  }
  pan(dx, dy) {
    this.view.projection.pan(dx, dy);
    this.touched = true;
  }
  key(event) {
    const { desk } = this;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const { projection } = this.view;
    const item = desk.item();
    if (arrow && item && desk.may && !this.stroke) {
      const step = event.shiftKey ? STRIDE_M : STEP_M;
      desk.replace(desk.selected, moved(item, arrow[0] * step, arrow[1] * step), `keys ${desk.selected.kind} ${desk.selected.index}`);
    } else if (arrow) this.pan(-48 * arrow[0], 48 * arrow[1]);
    else if (event.key === "+" || event.key === "=") this.zoom(1.25);
    else if (event.key === "-") this.zoom(1 / 1.25);
    else if (event.key === "0") this.fit();
    else if (event.key === "Enter" && this.stroke) this.put({ x_m: projection.x_m, y_m: projection.y_m }, event.shiftKey);
    else if (event.key === "Enter") {
      const found = hit(desk.building, projection.x_m, projection.y_m, REACH_PX / projection.scale);
      desk.select(found && { kind: found.kind, index: found.index });
    } else if (event.key === "Escape" && this.stroke) {
      if (this.stroke.places.length > 0) this.begin();
      else desk.setTool("select");
    } else if (event.key === "Escape") desk.select(null);
    else if ((event.key === "Delete" || event.key === "Backspace") && item && desk.may) desk.remove(desk.selected);
    else return;
    event.preventDefault();
    if (this.stroke) this.stroke.over = this.stroke.places.length > 0 ? { x_m: projection.x_m, y_m: projection.y_m } : null;
    this.redraw();
  }
  redraw() {
    if (this.due) return;
    this.due = requestAnimationFrame(() => {
      this.due = 0;
      this.draw();
    });
  }
  draw() {
    const { view, desk } = this;
    const { context, projection, ratio, palette, em } = view;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = palette.void;
    context.fillRect(0, 0, projection.width, projection.height);
    if (desk.draft && !this.showsPlan) {
      if (this.picture) drawPicture(view, this.picture, desk);
    } else drawGround(view, null);
    drawBuilding(view, desk);
    if (this.stroke) {
      drawStroke(view, desk, this.stroke);
      if (this.canvas.matches(":focus-visible")) drawCross(view);
    }
    if (!desk.draft || desk.reading.measured) drawScale(view, projection.width - 1.2 * em, projection.height - 0.9 * em, projection.width < 640 ? 70 : 110);
  }
  end() {
    this.turn += 1;
    cancelAnimationFrame(this.due);
    this.observer.disconnect();
    removeEventListener("sereno:theme", this.onTheme);
  }
}
