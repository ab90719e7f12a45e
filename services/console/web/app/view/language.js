// Which language, kept with the account, and before log-in with the browser.

import * as api from "../net/api.js";
import { currentLanguage, setLanguage } from "../words/text.js";

const KEY = "sereno.language";
let redraw = () => {};
let hasAccount = false;

function kept() {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

function browsers() {
  return navigator.languages?.some((name) => name.toLowerCase().startsWith("es")) ? "es" : "en";
}

/** `account` is the account's language or null; `draw` draws everything again. */
export function begin(account, known, draw) {
  redraw = draw;
  hasAccount = known;
  setLanguage(account || kept() || browsers());
  document.documentElement.lang = currentLanguage();
}

export function choose(language) {
  if (language === currentLanguage()) return;
  setLanguage(language);
  document.documentElement.lang = currentLanguage();
  try {
    localStorage.setItem(KEY, language);
  } catch {
    // Kept with the account below, where there is one.
  }
  if (hasAccount) api.keepLanguage(language).catch(() => {});
  redraw();
}
