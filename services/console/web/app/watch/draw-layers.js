// The layers that can be switched on: particles, sonar cones, certainty grid.

import { GRID_SIDE } from "../pure/binary.js";
import { SONAR, word } from "../pure/codes.js";
import { faint } from "./palette.js";

/** More particles than this say nothing more. */
const MOST_DOTS = 4000;
/** Half the width of a cone, and its reach without an echo (FACTS: HC-SR04 class). */
const HALF_CONE = Math.PI / 12;
const REACH_M = 4;
/** A reading older than this is not shown. */
const OLD_MS = 600;

export function drawParticles(view) {
  const { context, projection, palette, session } = view;
  const set = session.particles;
  if (!set) return;
  const step = Math.max(1, Math.ceil(set.count / MOST_DOTS));
  const size = Math.max(1.6, 0.03 * projection.scale);
  context.save();
  context.fillStyle = faint(palette.particle, 0.6);
  for (let k = 0; k < set.count; k += step) context.fillRect(projection.x(set.x_m[k]) - size / 2, projection.y(set.y_m[k]) - size / 2, size, size);
  context.restore();
}

export function drawSonar(view, now) {
  const { context, projection, palette, session } = view;
  const at = view.shown;
  if (!at || session.pose?.searching) return;
  for (const reading of session.sonars.values()) {
    if (reading.elevation_rad < -Math.PI / 4 || now - reading.at > OLD_MS) continue;
    const cosine = Math.cos(at.heading_rad);
    const sine = Math.sin(at.heading_rad);
    const x = projection.x(at.x_m + cosine * reading.mount_x_m - sine * reading.mount_y_m);
    const y = projection.y(at.y_m + sine * reading.mount_x_m + cosine * reading.mount_y_m);
    const axis = -(at.heading_rad + reading.bearing_rad);
    const status = reading.health > 0 ? "fault" : word(SONAR, reading.status);
    const range = status === "ok" ? reading.range_m : status === "fault" ? 0.6 : REACH_M;
    const color = status === "fault" ? palette.alarm : palette.sonar;
    context.save();
    context.beginPath();
    context.moveTo(x, y);
    context.arc(x, y, range * projection.scale, axis - HALF_CONE, axis + HALF_CONE);
    context.closePath();
    context.fillStyle = faint(color, status === "no_echo" ? 0.04 : status === "ok" ? 0.12 : 0.3);
    context.fill();
    if (status === "ok") {
      context.beginPath();
      context.arc(x, y, range * projection.scale, axis - HALF_CONE, axis + HALF_CONE);
      context.lineWidth = 2.5;
      context.strokeStyle = color;
      context.stroke();
    } else {
      context.setLineDash([3, 5]);
      context.lineWidth = 1;
      context.strokeStyle = faint(color, status === "fault" ? 0.9 : 0.35);
      context.stroke();
    }
    context.restore();
  }
}

/** The grid as an image, one pixel a cell, opacity by certainty. */
export class GridImage {
  constructor() {
    this.of = null;
    this.color = null;
    this.canvas = null;
  }
  make(grid, color) {
    if (this.of === grid && this.color === color) return this.canvas;
    const value = parseInt(color.slice(1), 16);
    const image = new ImageData(GRID_SIDE, GRID_SIDE);
    let most = 15;
    for (const cell of grid.cells) most = Math.max(most, cell);
    for (let k = 0; k < grid.cells.length; k += 1) {
      if (grid.cells[k] === 0) continue;
      const at = 4 * ((GRID_SIDE - 1 - Math.floor(k / GRID_SIDE)) * GRID_SIDE + (k % GRID_SIDE));
      image.data[at] = value >> 16;
      image.data[at + 1] = (value >> 8) & 255;
      image.data[at + 2] = value & 255;
      image.data[at + 3] = 40 + (200 * grid.cells[k]) / most;
    }
    this.canvas ??= new OffscreenCanvas(GRID_SIDE, GRID_SIDE);
    this.canvas.getContext("2d").putImageData(image, 0, 0);
    this.of = grid;
    this.color = color;
    return this.canvas;
  }
}

export function drawGrid(view, images) {
  const { context, projection, palette, session } = view;
  const { grid } = session;
  if (!grid || !(grid.cell_m > 0) || session.pose?.searching) return;
  const side = GRID_SIDE * grid.cell_m * projection.scale;
  const x = projection.x(grid.origin_x_m);
  const y = projection.y(grid.origin_y_m) - side;
  context.save();
  context.imageSmoothingEnabled = false;
  context.drawImage(images.make(grid, palette.grid), x, y, side, side);
  context.strokeStyle = faint(palette.grid, 0.35);
  context.setLineDash([3, 6]);
  context.strokeRect(x, y, side, side);
  context.restore();
}
