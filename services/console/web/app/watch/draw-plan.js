// Drawing what stays: floor, light of what was seen, walls, rooms, zones, pad.

import { ROOMS, word } from "../pure/codes.js";
import { scaleBar } from "../pure/projection.js";
import { faint } from "./palette.js";
import { number } from "../words/text.js";

/** The bitmap of seen cells as an image, one pixel a cell. Made anew only for a new message. */
export class SeenImage {
  constructor() {
    this.of = null;
    this.color = null;
    this.canvas = null;
  }
  make(patrol, color, side = 512) {
    const bits = patrol.seen;
    if (!(bits instanceof Uint8Array) || bits.length < (side * side) / 8) return null;
    if (this.of === bits && this.color === color) return this.canvas;
    const parts = color.match(/[\d.]+/g)?.map(Number) ?? [255, 190, 96, 17];
    const alpha = color.includes("%") ? parts[3] * 2.55 : (parts[3] ?? 1) * 255;
    const image = new ImageData(side, side);
    for (let k = 0; k < side * side; k += 1) {
      if (!(bits[k >> 3] & (1 << (k & 7)))) continue;
      const row = side - 1 - Math.floor(k / side);
      const at = 4 * (row * side + (k % side));
      image.data[at] = parts[0];
      image.data[at + 1] = parts[1];
      image.data[at + 2] = parts[2];
      image.data[at + 3] = alpha;
    }
    this.canvas ??= new OffscreenCanvas(side, side);
    this.canvas.getContext("2d").putImageData(image, 0, 0);
    this.of = bits;
    this.color = color;
    return this.canvas;
  }
}

export function drawGround(view, seen) {
  const { context, projection, palette, ground, ratio, session } = view;
  if (!ground) return;
  context.save();
  ground.place(context, projection, ratio);
  context.fillStyle = palette.floor;
  context.fill(ground.floor);
  context.restore();
  const patrol = session.patrol;
  if (patrol && session.layers.has("seen") && patrol.seen_cell_m > 0) {
    const image = seen.make(patrol, palette.lit);
    if (!image) drawSeenRooms(view, patrol);
    else {
      const size = image.width * patrol.seen_cell_m * projection.scale;
      context.save();
      context.imageSmoothingEnabled = true;
      context.drawImage(image, projection.x(patrol.seen_origin_x_m), projection.y(patrol.seen_origin_y_m) - size, size, size);
      context.restore();
    }
  }
  context.save();
  ground.place(context, projection, ratio);
  context.fillStyle = palette.wall;
  context.fill(ground.walls);
  context.restore();
}

/** Without the bitmap of seen cells each room is lit by its share. */
function drawSeenRooms(view, patrol) {
  const { context, palette, ground, projection, ratio, session } = view;
  const rooms = (patrol.rooms ?? []).slice(0, patrol.rooms_used).filter((room) => word(ROOMS, room.state) !== "skipped" && room.seen > 0);
  const shares = new Map(rooms.map((room) => [room.name, room.seen]));
  const light = new OffscreenCanvas(ground.width, ground.height);
  const pixels = light.getContext("2d");
  pixels.fillStyle = palette.lit;
  for (const room of session.about?.rooms ?? []) {
    if (!shares.has(room.name)) continue;
    pixels.globalAlpha = Math.min(shares.get(room.name), 1);
    pixels.beginPath();
    room.corners.forEach(([x_m, y_m], k) => pixels[k === 0 ? "moveTo" : "lineTo"](...ground.pixel(x_m, y_m)));
    pixels.fill();
  }
  pixels.globalAlpha = 1;
  pixels.globalCompositeOperation = "destination-in";
  pixels.drawImage(ground.mask, 0, 0);
  context.save();
  context.imageSmoothingEnabled = false;
  ground.place(context, projection, ratio);
  context.drawImage(light, 0, 0);
  context.restore();
}

function outline(context, projection, area) {
  context.beginPath();
  area.corners.forEach(([x, y], k) => (k === 0 ? context.moveTo(projection.x(x), projection.y(y)) : context.lineTo(projection.x(x), projection.y(y))));
  context.closePath();
}

/** Zones where it must not fly: hatched, with their names. */
export function drawZones(view) {
  const { context, projection, palette, session } = view;
  const zones = [
    ...(session.about?.no_fly ?? []).map((zone) => [zone, palette.alarm]),
    ...(session.about?.privacy ?? []).map((zone) => [zone, palette.info]),
  ];
  for (const [zone, color] of zones) {
    context.save();
    outline(context, projection, zone);
    context.fillStyle = faint(color, 0.1);
    context.fill();
    context.strokeStyle = faint(color, 0.8);
    context.lineWidth = 1.25;
    context.setLineDash([5, 4]);
    context.stroke();
    context.clip();
    context.setLineDash([]);
    context.strokeStyle = faint(color, 0.28);
    const left = projection.x(zone.box.left);
    const top = projection.y(zone.box.top);
    const width = projection.x(zone.box.right) - left;
    const height = projection.y(zone.box.bottom) - top;
    for (let d = -height; d < width; d += 9) {
      context.beginPath();
      context.moveTo(left + d, top + height);
      context.lineTo(left + d + height, top);
      context.stroke();
    }
    context.restore();
    if (zone.name && width > 40) label(view, zone.name, left + width / 2, top + height / 2, { color, size: 0.78, fit: width });
  }
}

/** Text with a halo of the floor's colour, so that lines below do not cross it. */
export function label(view, text, x, y, { color, size = 1, weight = 560, fit = Infinity, halo = view.palette.halo }) {
  const { context, palette, em } = view;
  context.save();
  let pixels = em * size;
  context.font = `${weight} ${pixels}px ${palette.font}`;
  const width = context.measureText(text).width;
  if (width > fit - 6) {
    pixels *= Math.max((fit - 6) / width, 0.5);
    if (pixels < em * 0.62) {
      context.restore();
      return false;
    }
    context.font = `${weight} ${pixels}px ${palette.font}`;
  }
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  context.strokeStyle = halo;
  context.globalAlpha = 0.75;
  context.lineWidth = pixels * 0.26;
  context.strokeText(text, x, y);
  context.globalAlpha = 1;
  context.fillStyle = color;
  context.fillText(text, x, y);
  context.restore();
  return true;
}

const ROOM_SIGN = { seen: "✓", skipped: "✕", partly: "◐" };

export function drawRooms(view) {
  const { projection, palette, session } = view;
  const patrol = session.patrol;
  const progress = new Map((patrol?.rooms ?? []).slice(0, patrol?.rooms_used ?? 0).map((room) => [room.name, room]));
  const colors = { seen: palette.ok, skipped: palette.caution, partly: palette.caution, entered: palette.text, waiting: palette.label };
  for (const room of session.about?.rooms ?? []) {
    const { box } = room;
    const state = progress.has(room.name) ? word(ROOMS, progress.get(room.name).state) : "waiting";
    const width = (box.right - box.left) * projection.scale;
    const x = projection.x((box.left + box.right) / 2);
    const y = projection.y(box.top) + Math.min(((box.top - box.bottom) * projection.scale) / 2, 1.9 * view.em);
    const sign = ROOM_SIGN[state] ? `${ROOM_SIGN[state]} ` : "";
    const style = { color: colors[state] ?? palette.label, size: projection.scale < 22 ? 0.74 : 0.86, weight: state === "entered" ? 680 : 580, fit: width };
    if (!label(view, `${sign}${room.name}`, x, y, style) && sign) label(view, room.name, x, y, style);
  }
}

export function drawPad(view) {
  const { context, projection, palette, session, em } = view;
  const patrol = session.patrol;
  const pad = session.about?.pad ?? (patrol && patrol.pad_x_m !== null ? { x_m: patrol.pad_x_m, y_m: patrol.pad_y_m } : null);
  if (!pad || pad.x_m === null) return;
  const x = projection.x(pad.x_m);
  const y = projection.y(pad.y_m);
  const radius = Math.max(0.32 * projection.scale, 0.62 * em);
  context.save();
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fillStyle = faint(palette.info, 0.14);
  context.fill();
  context.strokeStyle = palette.info;
  context.lineWidth = 1.75;
  context.stroke();
  const s = radius * 0.42;
  context.beginPath();
  for (const [ax, ay, bx, by] of [[-1, -1, -1, 1], [1, -1, 1, 1], [-1, 0, 1, 0]]) {
    context.moveTo(x + ax * s * 0.75, y + ay * s);
    context.lineTo(x + bx * s * 0.75, y + by * s);
  }
  context.lineWidth = Math.max(1.5, s * 0.3);
  context.lineCap = "round";
  context.stroke();
  context.restore();
}

export function drawScale(view, right, bottom, room) {
  const { context, projection, palette, em } = view;
  const metres = scaleBar(projection.scale, room);
  const width = metres * projection.scale;
  context.save();
  context.strokeStyle = palette.text2;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(right - width, bottom - 5);
  context.lineTo(right - width, bottom);
  context.lineTo(right, bottom);
  context.lineTo(right, bottom - 5);
  context.stroke();
  context.restore();
  label(view, `${number(metres, metres < 1 ? 1 : 0)} m`, right - width / 2, bottom - 0.75 * em, { color: palette.text2, size: 0.76, halo: palette.void });
}
