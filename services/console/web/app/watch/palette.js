// The canvas's colours, read from the style sheet when the light changes.

const NAMES = {
  void: "--plan-void", floor: "--plan-floor", wall: "--plan-wall", lit: "--plan-lit", label: "--plan-label", route: "--plan-route",
  path: "--plan-path", sonar: "--plan-sonar", grid: "--plan-grid", particle: "--plan-particle", halo: "--plan-halo",
  lamp: "--lamp", lampInk: "--lamp-ink", text: "--text", text2: "--text-2", text3: "--text-3", alarm: "--alarm", caution: "--caution", ok: "--ok", info: "--info", line: "--line", surface: "--surface",
};

export function readPalette() {
  const style = getComputedStyle(document.documentElement);
  const palette = Object.fromEntries(Object.entries(NAMES).map(([name, variable]) => [name, style.getPropertyValue(variable).trim()]));
  palette.font = style.getPropertyValue("--font").trim() || "sans-serif";
  return palette;
}

/** A colour of the palette with an opacity; `color` is #rrggbb. */
export function faint(color, alpha) {
  const hex = /^#([0-9a-f]{6})$/i.exec(color);
  if (!hex) return color;
  const value = parseInt(hex[1], 16);
  return `rgb(${value >> 16} ${(value >> 8) & 255} ${value & 255} / ${alpha})`;
}
