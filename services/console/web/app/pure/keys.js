// Keyboard to wishes: W A S D move, arrows climb and turn, space holds.

const KEYS = {
  KeyW: ["forward", 1], KeyS: ["forward", -1], KeyA: ["left", 1], KeyD: ["left", -1],
  ArrowUp: ["up", 1], ArrowDown: ["up", -1], ArrowLeft: ["turn", 1], ArrowRight: ["turn", -1],
};
/** A key is all or nothing, so it asks for this share of full speed. */
export const KEY_SHARE = 0.6;

/** Whether the key flies. */
export function flies(code) {
  return code === "Space" || Object.hasOwn(KEYS, code);
}

/** The wish of the keys that are down. */
export function wishOf(down) {
  const wish = { forward: 0, left: 0, up: 0, turn: 0, held: down.has("Space"), arm: "absent" };
  for (const code of down) {
    const key = Object.hasOwn(KEYS, code) ? KEYS[code] : null;
    if (key) wish[key[0]] += key[1] * KEY_SHARE;
  }
  return wish;
}
