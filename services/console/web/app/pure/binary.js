// The two messages that come as bytes, little endian, as they lie in the drone's shared memory.

const HEADER = 24;
const PARTICLES_HEAD = HEADER + 16 + 32 + 64 + 8;
const PARTICLE_COLUMNS = 8;
const GRID_HEAD = HEADER + 12 + 11;
/** Cells along each side of the certainty grid. */
export const GRID_SIDE = 81;

/** Splits a binary WebSocket message into the topic's name and its bytes; null when it is none. */
export function splitBinary(buffer) {
  if (buffer.byteLength < 2) return null;
  const name = new Uint8Array(buffer, 0, 1)[0];
  if (name === 0 || buffer.byteLength < 1 + name) return null;
  const topic = new TextDecoder().decode(new Uint8Array(buffer, 1, name));
  return { topic, bytes: new DataView(buffer, 1 + name) };
}

/**
 * `localization/particles`: head, then eight columns of f32 (x, y, velocity x, velocity y, heading offset, level roll, level pitch,
 * weight). Columns may be cut after their filled part, so the room of one follows from the length. Null when it makes no sense.
 */
export function particles(view) {
  const body = view.byteLength - PARTICLES_HEAD;
  if (body < 0 || body % (4 * PARTICLE_COLUMNS) !== 0) return null;
  const room = body / (4 * PARTICLE_COLUMNS);
  const count = Math.min(view.getUint32(PARTICLES_HEAD - 8, true), room);
  const column = (index) => {
    const out = new Float32Array(count);
    const start = PARTICLES_HEAD + 4 * room * index;
    for (let k = 0; k < count; k += 1) out[k] = view.getFloat32(start + 4 * k, true);
    return out;
  };
  return { count, x_m: column(0), y_m: column(1), offset_rad: column(4), weight: column(7) };
}

/** `navigation/grid`: lower left corner, cell side, then 81 x 81 certainties, row by row from below. Null when it makes no sense. */
export function grid(view) {
  if (view.byteLength < GRID_HEAD + GRID_SIDE * GRID_SIDE) return null;
  return {
    origin_x_m: view.getFloat32(HEADER, true),
    origin_y_m: view.getFloat32(HEADER + 4, true),
    cell_m: view.getFloat32(HEADER + 8, true),
    cells: new Uint8Array(view.buffer, view.byteOffset + GRID_HEAD, GRID_SIDE * GRID_SIDE).slice(),
  };
}
