// A plan's pixels as few rectangles, so that it can be drawn sharp at every zoom.

/**
 * Rectangles [x, y, width, height] in pixels that cover exactly the pixels for which `is(index)` holds: runs of a row, joined with equal
 * runs of the rows below.
 */
export function rectangles(width, height, is) {
  const done = [];
  let open = new Map();
  for (let y = 0; y < height; y += 1) {
    const next = new Map();
    let x = 0;
    while (x < width) {
      if (!is(y * width + x)) {
        x += 1;
        continue;
      }
      const start = x;
      while (x < width && is(y * width + x)) x += 1;
      const key = start * (width + 1) + x;
      const above = open.get(key);
      if (above) {
        above[3] += 1;
        next.set(key, above);
        open.delete(key);
      } else next.set(key, [start, y, x - start, 1]);
    }
    done.push(...open.values());
    open = next;
  }
  done.push(...open.values());
  return done;
}
