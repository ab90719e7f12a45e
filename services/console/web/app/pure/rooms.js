// Which room a place is in.

/** Name of the smallest room around (x, y), or null. */
export function roomAt(rooms, x_m, y_m) {
  let best = null;
  let least = Infinity;
  for (const { name, corners, box } of rooms) {
    if (x_m < box.left || x_m > box.right || y_m < box.bottom || y_m > box.top || !inside(corners, x_m, y_m)) continue;
    const area = (box.right - box.left) * (box.top - box.bottom);
    if (area < least) {
      least = area;
      best = name;
    }
  }
  return best;
}

function inside(corners, x, y) {
  let odd = false;
  for (let k = 0, before = corners.length - 1; k < corners.length; before = k, k += 1) {
    const [ax, ay] = corners[k];
    const [bx, by] = corners[before];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) odd = !odd;
  }
  return odd;
}

/** How many rooms of the round are done, and how many there are. */
export function progress(patrol) {
  const rooms = (patrol?.rooms ?? []).slice(0, patrol?.rooms_used ?? 0);
  return { done: rooms.filter((room) => room.state >= 2).length, all: rooms.length };
}
