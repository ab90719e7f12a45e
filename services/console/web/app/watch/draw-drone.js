// Drawing what moves: the drone as a lamp, how sure its place is, its path and route, competing places, the target.

import { ellipse } from "../pure/trust.js";
import { faint } from "./palette.js";
import { label } from "./draw-plan.js";
import { number } from "../words/text.js";

export function drawRoute(view) {
  const { context, projection, palette, session } = view;
  const patrol = session.patrol;
  if (!patrol || ![2, 3, 4, 8].includes(patrol.state)) return;
  const points = (patrol.waypoints ?? []).slice(patrol.next, patrol.waypoints_used).filter((point) => !(point.flags & 2));
  if (points.length === 0) return;
  context.save();
  context.strokeStyle = faint(palette.route, 0.55);
  context.lineWidth = 1.5;
  context.setLineDash([2, 6]);
  context.lineCap = "round";
  context.beginPath();
  if (view.shown) context.moveTo(projection.x(view.shown.x_m), projection.y(view.shown.y_m));
  for (const point of points) context.lineTo(projection.x(point.x_m), projection.y(point.y_m));
  context.stroke();
  context.setLineDash([]);
  context.fillStyle = faint(palette.route, 0.8);
  for (const point of points) {
    if (!(point.flags & 4)) continue;
    context.beginPath();
    context.arc(projection.x(point.x_m), projection.y(point.y_m), 2.4, 0, 2 * Math.PI);
    context.fill();
  }
  context.restore();
}

/** The path flown: the last minute bright, what lies before fainter. */
export function drawPath(view) {
  const { context, projection, palette, session } = view;
  const { points } = session.trail;
  if (points.length < 2) return;
  const stroke = (from, to, alpha) => {
    context.strokeStyle = faint(palette.path, alpha);
    context.beginPath();
    for (let k = Math.max(from, 0); k < to; k += 1) {
      const { x_m, y_m, gap } = points[k];
      if (gap || k === from) context.moveTo(projection.x(x_m), projection.y(y_m));
      else context.lineTo(projection.x(x_m), projection.y(y_m));
    }
    context.stroke();
  };
  context.save();
  context.lineJoin = "round";
  context.lineCap = "round";
  context.lineWidth = 2;
  const recent = Math.max(points.length - 220, 0);
  if (recent > 0) stroke(0, recent + 1, 0.35);
  stroke(recent, points.length, 0.85);
  context.restore();
}

/** The disc of two standard deviations around `at`, and what of it is known. */
function drawEllipse(view, at, pose, color) {
  const { context, projection } = view;
  const { major_m, minor_m, direction_rad } = ellipse(pose);
  const long = Math.min(2 * major_m, 12) * projection.scale;
  const short = Math.min(2 * minor_m, 12) * projection.scale;
  context.save();
  context.translate(projection.x(at.x_m), projection.y(at.y_m));
  context.rotate(-direction_rad);
  context.beginPath();
  context.ellipse(0, 0, Math.max(long, 1), Math.max(short, 1), 0, 0, 2 * Math.PI);
  context.fillStyle = faint(color, 0.13);
  context.fill();
  context.strokeStyle = faint(color, 0.9);
  context.setLineDash([5, 4]);
  context.lineWidth = 1.5;
  context.stroke();
  context.restore();
}

/** `view.shown` is where the drone is drawn; `fresh` false draws it grey, as the place where it was last known. */
export function drawDrone(view, fresh) {
  const { context, projection, palette, session, em } = view;
  const { pose } = session;
  const at = view.shown;
  if (!pose || !at || pose.searching) return;
  const { level } = session.trust;
  const good = level === "sure" || level === "fair";
  const color = !fresh ? palette.text3 : good ? palette.lamp : palette.caution;
  const x = projection.x(at.x_m);
  const y = projection.y(at.y_m);
  const radius = Math.max(view.radius_m * projection.scale, 0.55 * em);
  if (fresh) lamp(view, x, y, at.heading_rad, radius);
  drawEllipse(view, at, pose, color);
  context.save();
  context.translate(x, y);
  context.rotate(-at.heading_rad);
  context.beginPath();
  context.arc(0, 0, radius, 0, 2 * Math.PI);
  context.fillStyle = fresh ? color : palette.surface;
  context.fill();
  context.lineWidth = 2.5;
  context.strokeStyle = fresh ? palette.lampInk : color;
  context.stroke();
  context.beginPath();
  context.moveTo(radius * 0.72, 0);
  context.lineTo(-radius * 0.42, radius * 0.5);
  context.lineTo(-radius * 0.16, 0);
  context.lineTo(-radius * 0.42, -radius * 0.5);
  context.closePath();
  context.fillStyle = fresh ? palette.lampInk : color;
  context.fill();
  context.restore();
}

/** The light that the watchman carries: a glow, and a beam where it looks. */
function lamp(view, x, y, heading, radius) {
  const { context, projection, palette } = view;
  const reach = Math.max(2.2 * projection.scale, radius * 4);
  context.save();
  const glow = context.createRadialGradient(x, y, 0, x, y, reach * 0.7);
  glow.addColorStop(0, faint(palette.lamp, 0.34));
  glow.addColorStop(1, faint(palette.lamp, 0));
  context.fillStyle = glow;
  context.beginPath();
  context.arc(x, y, reach * 0.7, 0, 2 * Math.PI);
  context.fill();
  const beam = context.createRadialGradient(x, y, radius, x, y, reach);
  beam.addColorStop(0, faint(palette.lamp, 0.5));
  beam.addColorStop(1, faint(palette.lamp, 0));
  context.fillStyle = beam;
  context.beginPath();
  context.moveTo(x, y);
  context.arc(x, y, reach, -heading - 0.5, -heading + 0.5);
  context.closePath();
  context.fill();
  context.restore();
}

/** Competing places with their shares, while the drone is not sure. */
export function drawPlaces(view) {
  const { context, projection, palette, session } = view;
  if (!session.unsure || session.places.length === 0) return;
  for (const place of session.places) {
    const x = projection.x(place.x_m);
    const y = projection.y(place.y_m);
    const radius = Math.max(2 * place.spread_m * projection.scale, 1.1 * view.em);
    context.save();
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = faint(palette.particle, 0.08 + 0.3 * place.share);
    context.fill();
    context.strokeStyle = palette.particle;
    context.lineWidth = 1.75;
    context.stroke();
    context.restore();
    label(view, `${number(100 * place.share)} %`, x, y - radius - 0.6 * view.em, { color: palette.text, size: 0.86, weight: 640 });
  }
}

/** Where it was told to go, or is asked to. */
export function drawTarget(view, target, asked) {
  const { context, projection, palette, em } = view;
  const x = projection.x(target.x_m);
  const y = projection.y(target.y_m);
  const radius = 0.85 * em;
  context.save();
  context.strokeStyle = asked ? palette.lamp : palette.route;
  context.lineWidth = 2.25;
  if (view.shown && asked) {
    context.save();
    context.setLineDash([4, 6]);
    context.globalAlpha = 0.7;
    context.beginPath();
    context.moveTo(projection.x(view.shown.x_m), projection.y(view.shown.y_m));
    context.lineTo(x, y);
    context.stroke();
    context.restore();
  }
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(x + dx * radius * 0.55, y + dy * radius * 0.55);
    context.lineTo(x + dx * radius * 1.5, y + dy * radius * 1.5);
  }
  context.stroke();
  context.restore();
}
