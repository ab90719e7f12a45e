// The plan: a canvas that is panned, zoomed and clicked, and drawn only when something has changed.

import { planUrl } from "../net/api.js";
import { Projection } from "../pure/projection.js";
import { fitCanvas } from "../view/canvas-size.js";
import { h, iconButton, setData, show } from "../view/dom.js";
import { t } from "../words/text.js";
import { BaseLayer } from "./base-layer.js";
import { drawScale } from "./draw-plan.js";
import { drawDrone, drawPath, drawPlaces, drawRoute, drawTarget } from "./draw-drone.js";
import { GridImage, drawGrid, drawParticles, drawSonar } from "./draw-layers.js";
import { loadGround } from "./ground.js";
import { readPalette } from "./palette.js";

const FOLLOW_KEY = "sereno.follow";
/** The drawn drone follows the reported one with this time constant, so that 20 messages a second look like motion. */
const SMOOTH_MS = 70;
const CLICK_PX = 7;

export class PlanPanel {
  constructor(session) {
    this.session = session;
    this.canvas = h("canvas", { class: "plan-canvas", tabindex: "0", role: "img", "aria-label": t("plan.name"), "aria-describedby": "situation-words" });
    this.empty = h("p", { class: "plan-empty" }, t("plan.loading"));
    this.follow = iconButton(t("plan.follow"), "follow", { "aria-pressed": "false", onclick: () => this.setFollow(!this.following) });
    this.pick = h("div", { class: "plan-pick", hidden: true, role: "status" });
    this.tools = h("div", { class: "plan-tools", role: "group", "aria-label": t("plan.tools") },
      iconButton(t("plan.closer"), "plus", { onclick: () => this.zoom(1.35) }),
      iconButton(t("plan.farther"), "minus", { onclick: () => this.zoom(1 / 1.35) }),
      iconButton(t("plan.fit"), "fit", { onclick: () => this.fit() }),
      this.follow);
    this.element = h("div", { class: "plan" }, this.canvas, this.empty, this.tools, this.pick);
    this.view = {
      session, projection: new Projection(), palette: readPalette(), context: this.canvas.getContext("2d"), ground: null,
      ratio: 1, em: 16, shown: null, radius_m: 0.225,
    };
    this.base = new BaseLayer();
    this.gridImage = new GridImage();
    this.target = null;
    this.asking = null;
    /** Pixels at the top that something else lies over. */
    this.above = () => 0;
    this.following = false;
    this.pointers = new Map();
    this.dirty = true;
    this.last = 0;
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(this.element);
    this.onTheme = () => {
      this.view.palette = readPalette();
      this.dirty = true;
    };
    addEventListener("sereno:theme", this.onTheme);
    this.listen();
    this.handle = requestAnimationFrame((now) => this.frame(now));
    if (session.about) this.load();
  }
  async load() {
    const { about } = this.session;
    // The same once loaded; another one when the building was edited.
    if (!about || this.loading === about) return;
    this.loading = about;
    this.view.radius_m = about.radius_m;
    try {
      this.view.ground = await loadGround(planUrl(this.session.drone, about.hash), about);
      show(this.empty, false);
      this.fit();
      try {
        if (localStorage.getItem(FOLLOW_KEY) === "1") this.setFollow(true);
      } catch {
        // It does not follow then.
      }
    } catch {
      this.empty.textContent = t("plan.missing");
      this.loading = null;
    }
    this.dirty = true;
  }
  resize() {
    if (!fitCanvas(this.view, this.canvas, this.element)) return;
    if (!this.touched) this.fit();
    // At once: what was cleared would be seen as a flash.
    this.draw(this.fresh);
  }
  /** Where the tools lie below and not beside the plan. */
  get narrow() {
    return matchMedia("(max-width: 600px), (max-height: 520px)").matches;
  }
  /** What lies over the plan has changed its size. */
  refit() {
    if (!this.touched) this.fit();
  }
  fit() {
    const { ground, projection, em } = this.view;
    if (!ground) return;
    const { narrow } = this;
    projection.fit(ground.box, { top: this.above() + 0.8 * em, right: (narrow ? 1 : 4.6) * em, bottom: (narrow ? 4 : 2.2) * em, left: (narrow ? 1 : 1.6) * em });
    projection.least = projection.scale * 0.5;
    this.touched = false;
    this.setFollow(false);
    this.dirty = true;
  }
  zoom(factor, x, y) {
    this.view.projection.zoom(factor, x, y);
    this.touched = true;
    this.dirty = true;
  }
  setFollow(on) {
    this.following = on;
    this.follow.setAttribute("aria-pressed", String(on));
    if (on && this.view.projection.scale < 45) this.view.projection.scale = 45;
    if (on) this.touched = true;
    try {
      localStorage.setItem(FOLLOW_KEY, on ? "1" : "0");
    } catch {
      // Forgotten at the next visit.
    }
    this.dirty = true;
  }
  /** Asks for a place: `done(place)` with the click, null when called off. */
  askPlace(done) {
    this.asking = { done, place: null };
    show(this.pick, true);
    this.pick.textContent = t("plan.pick");
    setData(this.element, "asking", "true");
    this.canvas.focus({ preventScroll: true });
    this.dirty = true;
  }
  endAsking() {
    this.asking = null;
    show(this.pick, false);
    setData(this.element, "asking", "false");
    this.dirty = true;
  }
  setTarget(target) {
    this.target = target;
    this.dirty = true;
  }
  listen() {
    const { canvas, pointers } = this;
    const local = (event) => {
      const box = canvas.getBoundingClientRect();
      return { x: event.clientX - box.left, y: event.clientY - box.top };
    };
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, { ...local(event), moved: 0 });
    });
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      const now = local(event);
      if (!before) return;
      before.moved += Math.hypot(now.x - before.x, now.y - before.y);
      if (pointers.size === 1 && before.moved > CLICK_PX) {
        this.view.projection.pan(now.x - before.x, now.y - before.y);
        this.setFollow(false);
        this.touched = true;
      } else if (pointers.size === 2) {
        const other = [...pointers.entries()].find(([id]) => id !== event.pointerId)[1];
        const was = Math.hypot(before.x - other.x, before.y - other.y);
        const is = Math.hypot(now.x - other.x, now.y - other.y);
        if (was > 10 && is > 10) this.zoom(is / was, (now.x + other.x) / 2, (now.y + other.y) / 2);
        other.moved = CLICK_PX + 1;
      }
      Object.assign(before, now);
      this.dirty = true;
    });
    const up = (event) => {
      const pointer = pointers.get(event.pointerId);
      pointers.delete(event.pointerId);
      if (event.type === "pointerup" && pointer && pointer.moved <= CLICK_PX && this.asking) {
        this.asking.done(this.view.projection.place(pointer.x, pointer.y));
      }
    };
    canvas.addEventListener("pointerup", up);
    canvas.addEventListener("pointercancel", up);
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const { x, y } = local(event);
      this.zoom(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.0015)), x, y);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
  }
  key(event) {
    if (this.session.control?.hasLease) return;
    const pan = { ArrowLeft: [48, 0], ArrowRight: [-48, 0], ArrowUp: [0, 48], ArrowDown: [0, -48] }[event.key];
    const { projection } = this.view;
    if (pan) {
      projection.pan(...pan);
      this.setFollow(false);
      this.touched = true;
    } else if (event.key === "+" || event.key === "=") this.zoom(1.25);
    else if (event.key === "-") this.zoom(1 / 1.25);
    else if (event.key === "0") this.fit();
    else if (event.key === "Enter" && this.asking) this.asking.done({ x_m: projection.x_m, y_m: projection.y_m });
    else if (event.key === "Escape" && this.asking) this.asking.done(null);
    else return;
    event.preventDefault();
    this.dirty = true;
  }
  /** Moves the drawn drone towards the reported one; true while it still moves. */
  follows(now) {
    const { pose } = this.session;
    if (!pose || pose.x_m === null || pose.searching) {
      this.view.shown = null;
      return false;
    }
    const { shown } = this.view;
    const far = shown ? Math.hypot(pose.x_m - shown.x_m, pose.y_m - shown.y_m) : Infinity;
    const share = far > 1.5 ? 1 : 1 - Math.exp(-Math.min(now - this.last, 200) / SMOOTH_MS);
    if (share === 1 || !shown) {
      this.view.shown = { x_m: pose.x_m, y_m: pose.y_m, heading_rad: pose.heading_rad };
      return true;
    }
    const turn = Math.atan2(Math.sin(pose.heading_rad - shown.heading_rad), Math.cos(pose.heading_rad - shown.heading_rad));
    if (far < 0.002 && Math.abs(turn) < 0.002) return false;
    shown.x_m += (pose.x_m - shown.x_m) * share;
    shown.y_m += (pose.y_m - shown.y_m) * share;
    shown.heading_rad += turn * share;
    return true;
  }
  frame(now) {
    this.handle = requestAnimationFrame((next) => this.frame(next));
    if (now - this.last < 30) return;
    const moved = this.follows(now);
    this.last = now;
    if (this.following && this.view.shown) {
      const { projection, shown } = this.view;
      projection.x_m += (shown.x_m - projection.x_m) * 0.2;
      projection.y_m += (shown.y_m - projection.y_m) * 0.2;
    }
    const fresh = this.session.telemetry.news.freshness("localization/pose", performance.now());
    if (!this.dirty && !moved && fresh === this.fresh && !this.session.layers.has("sonar")) return;
    this.dirty = false;
    this.fresh = fresh;
    this.draw(fresh);
  }
  draw(fresh) {
    const { view, session } = this;
    const { context, projection, ratio, palette } = view;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = palette.void;
    context.fillRect(0, 0, projection.width, projection.height);
    this.base.draw(view);
    if (session.layers.has("grid")) drawGrid(view, this.gridImage);
    if (session.layers.has("particles")) drawParticles(view);
    if (session.layers.has("route")) drawRoute(view);
    if (session.layers.has("path")) drawPath(view);
    if (session.layers.has("sonar")) drawSonar(view, performance.now());
    drawPlaces(view);
    if (this.target) drawTarget(view, this.target, false);
    drawDrone(view, fresh === "live" || fresh === "late");
    if (this.asking?.place) drawTarget(view, this.asking.place, true);
    const { narrow } = this;
    drawScale(view, projection.width - (narrow ? 1.2 : 4.6) * view.em, projection.height - (narrow ? 1.2 : 0.8) * view.em, narrow ? 70 : 110);
  }
  end() {
    cancelAnimationFrame(this.handle);
    this.observer.disconnect();
    removeEventListener("sereno:theme", this.onTheme);
  }
}
