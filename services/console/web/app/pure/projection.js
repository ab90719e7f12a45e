// From the plan (metres, x right, y up) to the screen (pixels, y down) and back: pan and zoom without a canvas.

/** Where the middle of the view is on the plan, and how many pixels a metre has. */
export class Projection {
  constructor() {
    this.x_m = 0;
    this.y_m = 0;
    this.scale = 40;
    this.width = 1;
    this.height = 1;
    this.least = 4;
    this.most = 400;
  }
  resize(width, height) {
    this.width = Math.max(width, 1);
    this.height = Math.max(height, 1);
  }
  /** Shows the rectangle {left, bottom, right, top} (metres) with `margin` pixels around, {top, right, bottom, left} or a number. */
  fit(box, margin = 24) {
    const m = typeof margin === "number" ? { top: margin, right: margin, bottom: margin, left: margin } : margin;
    const wide = Math.max(box.right - box.left, 0.1);
    const high = Math.max(box.top - box.bottom, 0.1);
    const room_x = Math.max(this.width - m.left - m.right, 40);
    const room_y = Math.max(this.height - m.top - m.bottom, 40);
    this.scale = this.bounded(Math.min(room_x / wide, room_y / high));
    this.x_m = (box.left + box.right) / 2 + (m.right - m.left) / 2 / this.scale;
    this.y_m = (box.bottom + box.top) / 2 - (m.bottom - m.top) / 2 / this.scale;
  }
  bounded(scale) {
    return Math.min(Math.max(scale, this.least), this.most);
  }
  x(x_m) {
    return this.width / 2 + (x_m - this.x_m) * this.scale;
  }
  y(y_m) {
    return this.height / 2 - (y_m - this.y_m) * this.scale;
  }
  place(x, y) {
    return { x_m: this.x_m + (x - this.width / 2) / this.scale, y_m: this.y_m - (y - this.height / 2) / this.scale };
  }
  pan(dx, dy) {
    this.x_m -= dx / this.scale;
    this.y_m += dy / this.scale;
  }
  /** Zooms by `factor` and keeps what is under (x, y) where it is. */
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const before = this.place(x, y);
    this.scale = this.bounded(this.scale * factor);
    const after = this.place(x, y);
    this.x_m += before.x_m - after.x_m;
    this.y_m += before.y_m - after.y_m;
  }
}

/** A round length in metres whose bar is at most `pixels` wide: 0.5, 1, 2, 5, 10 ... */
export function scaleBar(scale, pixels) {
  const most = pixels / scale;
  const power = 10 ** Math.floor(Math.log10(most));
  const step = [5, 2, 1].find((factor) => factor * power <= most) ?? 1;
  return step * power;
}
