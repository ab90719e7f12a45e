// What stays on the plan, drawn once for a zoom: panning, following and the drone's motion then cost one copy a frame, and leave the
// processor to the sticks.

import { Projection } from "../pure/projection.js";
import { SeenImage, drawGround, drawPad, drawRooms, drawZones } from "./draw-plan.js";

/** A larger picture (device pixels) is not kept but drawn anew each time: a large building from very near. */
const MOST_PIXELS = 16_000_000;
/** Room names and the pad may reach over the plan's edge by so many pixels. */
const EDGE = 40;

export class BaseLayer {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.seen = new SeenImage();
    this.key = "";
    this.palette = null;
  }
  /** Everything that a drawing depends on but the projection's middle. */
  keyOf({ projection, ratio, session, em }) {
    const { patrol } = session;
    const rooms = (patrol?.rooms ?? []).slice(0, patrol?.rooms_used ?? 0).map((room) => `${room.state}:${Math.round(50 * room.seen)}`);
    return [projection.scale, ratio, em, session.layers.has("seen"), patrol?.pad_x_m, patrol?.pad_y_m, rooms].join();
  }
  draw(view) {
    const { context, projection, ratio, ground } = view;
    if (!ground) return;
    const { box } = ground;
    const width = (box.right - box.left) * projection.scale + 2 * EDGE;
    const height = (box.top - box.bottom) * projection.scale + 2 * EDGE;
    if (width * height * ratio * ratio > MOST_PIXELS) {
      this.paint(view);
      return;
    }
    const key = this.keyOf(view);
    const bitmap = view.session.patrol?.seen ?? null;
    if (key !== this.key || this.palette !== view.palette || this.ground !== ground || this.bitmap !== bitmap) {
      Object.assign(this, { key, palette: view.palette, ground, bitmap });
      this.canvas.width = Math.ceil(width * ratio);
      this.canvas.height = Math.ceil(height * ratio);
      const inner = new Projection();
      inner.resize(width, height);
      inner.scale = projection.scale;
      inner.x_m = (box.left + box.right) / 2;
      inner.y_m = (box.bottom + box.top) / 2;
      const own = this.canvas.getContext("2d");
      own.setTransform(ratio, 0, 0, ratio, 0, 0);
      this.paint({ ...view, context: own, projection: inner });
    }
    context.drawImage(this.canvas, projection.x(box.left) - EDGE, projection.y(box.top) - EDGE, this.canvas.width / ratio, this.canvas.height / ratio);
  }
  paint(view) {
    drawGround(view, this.seen);
    drawZones(view);
    drawRooms(view);
    drawPad(view);
  }
}
