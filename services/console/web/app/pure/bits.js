// 64-bit words in JSON: JavaScript's numbers hold 53 bits, so bitmaps are read before `JSON.parse` can round them.

const BITMAPS = /"(seen|unmapped)":\[([0-9,\s]*)\]/g;

/** Parses a telemetry message; the bitmaps `seen` and `unmapped` become Uint8Array with 8 bits a byte, lowest bit first. */
export function parse(text) {
  const found = new Map();
  const rest = text.includes('"unmapped":[') || text.includes('"seen":[')
    ? text.replace(BITMAPS, (_, name, words) => {
        found.set(name, words);
        return `"${name}":null`;
      })
    : text;
  const value = JSON.parse(rest);
  if (found.size > 0 && value.data) for (const [name, words] of found) value.data[name] = bytes(words);
  return value;
}

/** Little-endian bytes of a comma-separated list of 64-bit words. */
export function bytes(words) {
  const list = words.trim() === "" ? [] : words.split(",");
  const out = new Uint8Array(8 * list.length);
  const view = new DataView(out.buffer);
  for (let k = 0; k < list.length; k += 1) {
    const word = list[k];
    if (word !== "0") view.setBigUint64(8 * k, BigInt(word), true);
  }
  return out;
}
