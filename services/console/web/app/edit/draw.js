// Drawing the building as it is edited: over floor and walls, or over the picture of a draft.

import { AREAS, cornersOf, itemsOf } from "../pure/building.js";
import { label } from "../watch/draw-plan.js";
import { faint } from "../watch/palette.js";

const COLORS = { rooms: "info", no_fly: "alarm", privacy: "particle" };

/** The picture with what is dark as walls: at most 2000 pixels a side, made anew when the threshold moves. */
export class PictureImage {
  constructor(image) {
    const { naturalWidth: width, naturalHeight: height } = image;
    const canvas = new OffscreenCanvas(width, height);
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(image, 0, 0);
    this.shades = context.getImageData(0, 0, width, height).data;
    this.canvas = canvas;
    this.context = context;
    this.key = "";
  }
  make(dark_below, wall, floor) {
    const key = `${dark_below} ${wall} ${floor}`;
    if (key === this.key) return this.canvas;
    this.key = key;
    const { width, height } = this.canvas;
    const image = new ImageData(width, height);
    const colors = new Uint32Array(image.data.buffer);
    const [dark, light] = [packed(wall), packed(floor)];
    for (let k = 0; k < colors.length; k += 1) colors[k] = this.shades[4 * k] < dark_below ? dark : light;
    this.context.putImageData(image, 0, 0);
    return this.canvas;
  }
}

function packed(hex) {
  const value = parseInt(hex.slice(1, 7), 16) || 0;
  return ((255 << 24) | ((value & 255) << 16) | (value & 0xff00) | (value >> 16)) >>> 0;
}

export function drawPicture(view, picture, desk) {
  const { context, projection, palette } = view;
  const { reading, draft } = desk;
  const canvas = picture.make(reading.dark_below, palette.wall, palette.floor);
  const width = draft.width * reading.metres_per_pixel * projection.scale;
  const height = draft.height * reading.metres_per_pixel * projection.scale;
  context.save();
  context.imageSmoothingEnabled = width < canvas.width * 2;
  context.drawImage(canvas, projection.x(0), projection.y(0) - height, width, height);
  for (const [ax, ay, bx, by] of reading.wiped) {
    const [left, top] = [projection.x(Math.min(ax, bx)), projection.y(Math.max(ay, by))];
    const [wide, high] = [Math.abs(bx - ax) * projection.scale, Math.abs(by - ay) * projection.scale];
    context.fillStyle = palette.floor;
    context.fillRect(left, top, wide, high);
    context.setLineDash([3, 3]);
    context.strokeStyle = palette.text3;
    context.strokeRect(left, top, wide, high);
  }
  context.setLineDash([]);
  context.strokeStyle = palette.lamp;
  context.lineWidth = Math.max(0.1 * projection.scale, 3);
  for (const [ax, ay, bx, by] of reading.walls) line(view, [ax, ay], [bx, by]);
  context.restore();
}

function line({ context, projection }, [ax, ay], [bx, by]) {
  context.beginPath();
  context.moveTo(projection.x(ax), projection.y(ay));
  context.lineTo(projection.x(bx), projection.y(by));
  context.stroke();
}

function outline({ context, projection }, corners, close = true) {
  context.beginPath();
  corners.forEach(([x, y], k) => context[k === 0 ? "moveTo" : "lineTo"](projection.x(x), projection.y(y)));
  if (close) context.closePath();
}

function hatch({ context, projection }, corners, color) {
  const xs = corners.map(([x]) => projection.x(x));
  const ys = corners.map(([, y]) => projection.y(y));
  const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  context.save();
  context.clip();
  context.strokeStyle = color;
  context.lineWidth = 1.25;
  // What is far outside the canvas is not drawn.
  const from = Math.max(left - (bottom - top), -4000);
  for (let x = from; x < Math.min(right, 6000); x += 9) {
    context.beginPath();
    context.moveTo(x, bottom);
    context.lineTo(x + bottom - top, top);
    context.stroke();
  }
  context.restore();
}

function middle(corners) {
  const xs = corners.map(([x]) => x);
  const ys = corners.map(([, y]) => y);
  return [(Math.min(...xs) + Math.max(...xs)) / 2, (Math.min(...ys) + Math.max(...ys)) / 2, Math.max(...xs) - Math.min(...xs)];
}

function drawRoom(view, room, desk, chosen) {
  const { context, projection, palette, em } = view;
  const corners = cornersOf(room);
  const { order, leave_out } = desk.building.round;
  const out = leave_out.includes(room.name);
  const place = order.indexOf(room.name);
  outline(view, corners);
  if (chosen || desk.draft || desk.tool === "rooms") {
    context.strokeStyle = faint(palette.info, chosen ? 1 : 0.55);
    context.lineWidth = chosen ? 2.25 : 1.25;
    context.stroke();
    if (chosen) {
      context.fillStyle = faint(palette.info, 0.12);
      context.fill();
    }
  }
  if (out) hatch(view, corners, faint(palette.text3, 0.35));
  const [x, y, wide] = middle(corners);
  const px = projection.x(x);
  const top = Math.min(...corners.map((corner) => projection.y(corner[1])));
  const py = Math.min(projection.y(y), top + 1.9 * em);
  label(view, room.name, px, py, { color: out ? palette.text3 : palette.label, size: projection.scale < 22 ? 0.74 : 0.86, weight: 600, fit: wide * projection.scale });
  if (place >= 0) badge(view, String(place + 1), px, py + 1.5 * em, palette.lamp, palette.lampInk);
}

function badge(view, text, x, y, color, ink) {
  const { context, palette, em } = view;
  context.save();
  context.beginPath();
  context.arc(x, y, 0.78 * em, 0, 2 * Math.PI);
  context.fillStyle = color;
  context.fill();
  context.fillStyle = ink;
  context.font = `700 ${0.86 * em}px ${palette.font}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillText(text, x, y + 0.5);
  context.restore();
}

function drawZone(view, zone, color, chosen) {
  const { context, projection } = view;
  const corners = cornersOf(zone);
  outline(view, corners);
  context.fillStyle = faint(color, chosen ? 0.22 : 0.12);
  context.fill();
  hatch(view, corners, faint(color, 0.3));
  outline(view, corners);
  context.strokeStyle = color;
  context.lineWidth = chosen ? 2.25 : 1.5;
  context.setLineDash(chosen ? [] : [6, 4]);
  context.stroke();
  context.setLineDash([]);
  const [x, y, wide] = middle(corners);
  if (wide * projection.scale > 34) label(view, zone.name, projection.x(x), projection.y(y), { color, size: 0.78, fit: wide * projection.scale });
}

function drawDoor(view, door, chosen) {
  const { context, palette } = view;
  context.save();
  context.strokeStyle = palette.ok;
  context.lineWidth = chosen ? 5 : 3;
  context.lineCap = "round";
  line(view, door.a, door.b);
  context.restore();
}

function drawPoint(view, point, chosen) {
  const { context, projection, palette, em } = view;
  const [x, y] = [projection.x(point.x), projection.y(point.y)];
  const r = 0.5 * em;
  context.save();
  context.beginPath();
  context.moveTo(x, y);
  context.bezierCurveTo(x - 2.2 * r, y - 2.4 * r, x - 1.5 * r, y - 4 * r, x, y - 4 * r);
  context.bezierCurveTo(x + 1.5 * r, y - 4 * r, x + 2.2 * r, y - 2.4 * r, x, y);
  context.fillStyle = palette.lamp;
  context.fill();
  context.strokeStyle = chosen ? palette.text : palette.halo;
  context.lineWidth = chosen ? 2.5 : 1.5;
  context.stroke();
  context.beginPath();
  context.arc(x, y - 2.6 * r, 0.55 * r, 0, 2 * Math.PI);
  context.fillStyle = palette.lampInk;
  context.fill();
  context.restore();
  label(view, point.name, x, y + 0.85 * em, { color: palette.text, size: 0.8, weight: 600 });
}

function drawPad(view, pad, chosen) {
  const { context, projection, palette, em } = view;
  const [x, y] = [projection.x(pad.x), projection.y(pad.y)];
  const r = Math.max(0.32 * projection.scale, 0.75 * em);
  const turn = (-(pad.heading_deg ?? 0) * Math.PI) / 180;
  context.save();
  context.beginPath();
  context.arc(x, y, r, 0, 2 * Math.PI);
  context.fillStyle = faint(palette.info, 0.2);
  context.fill();
  context.strokeStyle = palette.info;
  context.lineWidth = chosen ? 3 : 2;
  context.stroke();
  // Which way it looks when it is put down.
  context.translate(x, y);
  context.rotate(turn);
  context.beginPath();
  context.moveTo(r * 1.55, 0);
  context.lineTo(r * 1.02, -r * 0.42);
  context.lineTo(r * 1.02, r * 0.42);
  context.closePath();
  context.fillStyle = palette.info;
  context.fill();
  context.restore();
  label(view, "H", x, y + 0.5, { color: palette.info, size: 0.9, weight: 700 });
}

function handles(view, item) {
  const { context, projection, palette } = view;
  const corners = item.a ? [item.a, item.b] : item.x === undefined ? cornersOf(item) : [];
  for (const [x, y] of corners) {
    context.beginPath();
    context.arc(projection.x(x), projection.y(y), 5.5, 0, 2 * Math.PI);
    context.fillStyle = palette.surface;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = palette.text;
    context.stroke();
  }
}

export function drawBuilding(view, desk) {
  const { palette } = view;
  const { selected, building } = desk;
  const is = (kind, index) => selected?.kind === kind && selected.index === index;
  for (const kind of AREAS) {
    building[kind].forEach((area, k) => {
      if (kind === "rooms") drawRoom(view, area, desk, is(kind, k));
      else drawZone(view, area, palette[COLORS[kind]], is(kind, k));
    });
  }
  building.doors.forEach((door, k) => drawDoor(view, door, is("doors", k)));
  if (building.pad) drawPad(view, building.pad, selected?.kind === "pad");
  itemsOf(building, "points").forEach((point, k) => drawPoint(view, point, is("points", k)));
  const item = desk.item();
  if (item && desk.may) handles(view, item);
}

/** What is being drawn: corners so far and where the pointer is. */
export function drawStroke(view, desk, stroke) {
  const { context, projection, palette } = view;
  const { places, over, kind } = stroke;
  const all = [...places, ...(over ? [over] : [])].map(({ x_m, y_m }) => [x_m, y_m]);
  if (all.length === 0) return;
  const color = palette[COLORS[kind]] ?? palette.lamp;
  context.save();
  context.strokeStyle = color;
  context.lineWidth = 2;
  if (stroke.form === "rectangle" && all.length > 1) {
    const [[ax, ay], [bx, by]] = [all[0], all.at(-1)];
    outline(view, [[ax, ay], [bx, ay], [bx, by], [ax, by]]);
    context.fillStyle = faint(color, 0.14);
    context.fill();
  } else outline(view, all, false);
  context.stroke();
  for (const [x, y] of all) {
    context.beginPath();
    context.arc(projection.x(x), projection.y(y), 4, 0, 2 * Math.PI);
    context.fillStyle = color;
    context.fill();
  }
  context.restore();
}

/** Where Enter would click. */
export function drawCross({ context, projection, palette }) {
  const [x, y] = [projection.width / 2, projection.height / 2];
  context.save();
  context.strokeStyle = palette.lamp;
  context.lineWidth = 1.5;
  for (const [ax, ay, bx, by] of [[-14, 0, -4, 0], [4, 0, 14, 0], [0, -14, 0, -4], [0, 4, 0, 14]]) {
    context.beginPath();
    context.moveTo(x + ax, y + ay);
    context.lineTo(x + bx, y + by);
    context.stroke();
  }
  context.restore();
}
