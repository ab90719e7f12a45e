// Competing hypotheses: where the weight of a particle set lies, as a few places with their shares.

/**
 * Places that hold more than `least` of the weight, heaviest first: [{x_m, y_m, share, spread_m}]. Particles are gathered on a
 * raster of `cell_m`; touching cells are one place. Works in one pass over the particles and one over the cells.
 */
export function clusters(set, cell_m = 0.5, least = 0.05) {
  const cells = new Map();
  let total = 0;
  for (let k = 0; k < set.count; k += 1) {
    const weight = set.weight[k];
    if (!(weight > 0) || !Number.isFinite(set.x_m[k]) || !Number.isFinite(set.y_m[k])) continue;
    const column = Math.floor(set.x_m[k] / cell_m);
    const row = Math.floor(set.y_m[k] / cell_m);
    const key = `${column},${row}`;
    let cell = cells.get(key);
    if (!cell) cells.set(key, (cell = { column, row, weight: 0, x: 0, y: 0, xx: 0, done: false }));
    cell.weight += weight;
    cell.x += weight * set.x_m[k];
    cell.y += weight * set.y_m[k];
    cell.xx += weight * (set.x_m[k] ** 2 + set.y_m[k] ** 2);
    total += weight;
  }
  if (total <= 0) return [];
  const places = [];
  for (const first of cells.values()) {
    if (first.done || first.weight < 0.001 * total) continue;
    first.done = true;
    const open = [first];
    const sum = { weight: 0, x: 0, y: 0, xx: 0 };
    while (open.length > 0) {
      const cell = open.pop();
      for (const name of ["weight", "x", "y", "xx"]) sum[name] += cell[name];
      for (let dx = -1; dx <= 1; dx += 1) {
        for (let dy = -1; dy <= 1; dy += 1) {
          const next = cells.get(`${cell.column + dx},${cell.row + dy}`);
          if (next && !next.done && next.weight >= 0.001 * total) {
            next.done = true;
            open.push(next);
          }
        }
      }
    }
    const x_m = sum.x / sum.weight;
    const y_m = sum.y / sum.weight;
    const spread_m = Math.sqrt(Math.max(sum.xx / sum.weight - x_m ** 2 - y_m ** 2, 0));
    if (sum.weight >= least * total) places.push({ x_m, y_m, share: sum.weight / total, spread_m });
  }
  return places.sort((a, b) => b.share - a.share).slice(0, 9);
}
