// The polar histogram: density around the drone, threshold, valleys, the chosen direction and why.

import { REASONS, word } from "../pure/codes.js";
import { h, s, icon, setText } from "../view/dom.js";
import { t } from "../words/text.js";

const SECTORS = 72;
const SIZE = 220;
const MIDDLE = SIZE / 2;
const INNER = 22;
const OUTER = 92;

/** A ring segment of sector `k` from radius `a` to `b`; plan frame, 0 to the right, counter-clockwise. */
function segment(k, a, b) {
  const from = -(2 * Math.PI * (k - 0.5)) / SECTORS;
  const to = -(2 * Math.PI * (k + 0.5)) / SECTORS;
  const point = (radius, angle) => `${(MIDDLE + radius * Math.cos(angle)).toFixed(1)} ${(MIDDLE + radius * Math.sin(angle)).toFixed(1)}`;
  return `M${point(a, from)}L${point(b, from)}A${b} ${b} 0 0 0 ${point(b, to)}L${point(a, to)}A${a} ${a} 0 0 1 ${point(a, from)}Z`;
}

/** Sectors from `first` to `last` inclusive, through 71 to 0 where need be. */
export function valley(first, last) {
  if (first >= SECTORS || last >= SECTORS) return [];
  const found = [];
  for (let k = first; ; k = (k + 1) % SECTORS) {
    found.push(k);
    if (k === last || found.length >= SECTORS) return found;
  }
}

export class PolarPanel {
  constructor(session) {
    this.session = session;
    this.bars = Array.from({ length: SECTORS }, () => s("path", { class: "polar-bar" }));
    this.free = s("path", { class: "polar-valley" });
    this.threshold = s("circle", { class: "polar-threshold", cx: MIDDLE, cy: MIDDLE, r: INNER });
    this.target = s("line", { class: "polar-target" });
    this.chosen = s("line", { class: "polar-chosen" });
    this.heading = s("path", { class: "polar-heading", d: "M9 0L-6 5.5L-3 0L-6 -5.5Z" });
    this.reason = h("p", { class: "polar-reason" });
    this.chart = s("svg", { viewBox: `0 0 ${SIZE} ${SIZE}`, class: "polar-chart", role: "img", "aria-label": t("polar.name") },
      s("circle", { class: "polar-ring", cx: MIDDLE, cy: MIDDLE, r: OUTER }), this.free, this.bars, this.threshold, this.target, this.chosen, this.heading);
    this.element = h("section", { class: "panel polar", "aria-label": t("polar.name") },
      h("header", { class: "panel-head" }, icon("wind"), h("h2", {}, t("polar.name"))), this.chart, this.reason,
      h("ul", { class: "legend" }, ["blocked", "free", "threshold", "target", "chosen"].map((name) => h("li", { data: { name } }, t(`polar.${name}`)))));
    this.drawn = null;
  }
  update() {
    const { polar, pose } = this.session;
    if (!polar || polar === this.drawn) return;
    this.drawn = polar;
    const high = polar.threshold_high ?? 0;
    const top = Math.max(1.6 * high, ...polar.smoothed, 1e-6);
    const radius = (value) => INNER + (OUTER - INNER) * Math.min(Math.max(value / top, 0), 1);
    this.bars.forEach((bar, k) => {
      bar.setAttribute("d", segment(k, INNER, Math.max(radius(polar.smoothed[k] ?? 0), INNER + 0.5)));
      bar.dataset.blocked = String(polar.blocked[k] === 1);
    });
    this.free.setAttribute("d", valley(polar.valley_first, polar.valley_last).map((k) => segment(k, INNER, OUTER)).join(""));
    this.threshold.setAttribute("r", high ? radius(high) : 0);
    this.line(this.target, polar.target_rad, OUTER + 6);
    this.line(this.chosen, polar.chosen_rad, OUTER + 12);
    const heading = pose?.heading_rad ?? 0;
    this.heading.setAttribute("transform", `translate(${MIDDLE} ${MIDDLE}) rotate(${((-heading * 180) / Math.PI).toFixed(1)})`);
    setText(this.reason, t(`reason.${word(REASONS, polar.reason)}`));
  }
  line(line, angle, length) {
    const there = angle !== null && Number.isFinite(angle);
    line.setAttribute("visibility", there ? "visible" : "hidden");
    if (!there) return;
    for (const [name, value] of Object.entries({
      x1: MIDDLE + (INNER - 6) * Math.cos(angle), y1: MIDDLE - (INNER - 6) * Math.sin(angle), x2: MIDDLE + length * Math.cos(angle), y2: MIDDLE - length * Math.sin(angle),
    })) line.setAttribute(name, value.toFixed(1));
  }
}
