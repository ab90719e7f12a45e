// Light or dark: as the system says until somebody chooses.

const KEY = "sereno.theme";
const system = matchMedia("(prefers-color-scheme: light)");

function chosen() {
  try {
    const value = localStorage.getItem(KEY);
    return value === "light" || value === "dark" ? value : null;
  } catch {
    return null;
  }
}

function apply() {
  const theme = chosen() ?? (system.matches ? "light" : "dark");
  if (document.documentElement.dataset.theme === theme) return;
  document.documentElement.dataset.theme = theme;
  document.querySelector('meta[name="theme-color"]').content = theme === "dark" ? "#070c18" : "#eaeef6";
  dispatchEvent(new Event("sereno:theme"));
}

export function begin() {
  system.addEventListener("change", apply);
  apply();
}

export function current() {
  return document.documentElement.dataset.theme;
}

export function toggle() {
  try {
    localStorage.setItem(KEY, current() === "dark" ? "light" : "dark");
  } catch {
    // Without storage the system's choice stays.
  }
  apply();
}
