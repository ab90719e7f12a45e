// The plan as paths: floor and walls, traced once from the image.

import { rectangles } from "../pure/walls.js";

/** A pixel darker than this is a wall, lighter than that floor, between the two nothing is known (ROS map_server's grey is 205). */
const WALL = 90;
const FLOOR = 230;
/** Above this a plan is traced from a smaller copy. */
const MOST_PIXELS = 4_000_000;

/** {floor, walls: Path2D in pixels, mask: the floor as an image, width, height, box: metres, pixel(x_m, y_m), place(context, projection, ratio)} */
export async function loadGround(url, about) {
  const image = new Image();
  image.src = url;
  await image.decode();
  const shrink = Math.min(1, Math.sqrt(MOST_PIXELS / (image.naturalWidth * image.naturalHeight)));
  const width = Math.max(1, Math.round(image.naturalWidth * shrink));
  const height = Math.max(1, Math.round(image.naturalHeight * shrink));
  const canvas = new OffscreenCanvas(width, height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.drawImage(image, 0, 0, width, height);
  const { data } = context.getImageData(0, 0, width, height);
  const grey = (index) => (data[4 * index] + data[4 * index + 1] + data[4 * index + 2]) / 3;
  const path = (is) => {
    const shape = new Path2D();
    for (const [x, y, w, h] of rectangles(width, height, is)) shape.rect(x, y, w, h);
    return shape;
  };
  const mask = new OffscreenCanvas(width, height);
  const pixels = new ImageData(width, height);
  for (let index = 0; index < width * height; index += 1) pixels.data[4 * index + 3] = grey(index) >= FLOOR ? 255 : 0;
  mask.getContext("2d").putImageData(pixels, 0, 0);
  const cell = (about.resolution_m * image.naturalWidth) / width;
  return {
    floor: path((index) => grey(index) >= FLOOR),
    walls: path((index) => grey(index) < WALL),
    mask, width, height, cell,
    box: inked(grey, width, height, cell, about),
    pixel: (x_m, y_m) => [(x_m - about.origin_x_m) / cell, height - (y_m - about.origin_y_m) / cell],
    /** Sets the context so that the paths lie where they belong. */
    place(context, projection, ratio) {
      const scale = projection.scale * cell * ratio;
      context.setTransform(scale, 0, 0, scale, projection.x(about.origin_x_m) * ratio, projection.y(about.origin_y_m + height * cell) * ratio);
    },
  };
}

/** The rectangle (metres) around everything that is drawn on the plan. */
function inked(grey, width, height, cell, about) {
  let left = width;
  let right = 0;
  let top = height;
  let bottom = 0;
  for (let y = 0; y < height; y += 1) {
    for (let x = 0; x < width; x += 1) {
      if (grey(y * width + x) >= WALL) continue;
      left = Math.min(left, x);
      right = Math.max(right, x + 1);
      top = Math.min(top, y);
      bottom = Math.max(bottom, y + 1);
    }
  }
  if (left >= right) [left, right, top, bottom] = [0, width, 0, height];
  return {
    left: about.origin_x_m + left * cell, right: about.origin_x_m + right * cell,
    bottom: about.origin_y_m + (height - bottom) * cell, top: about.origin_y_m + (height - top) * cell,
  };
}
