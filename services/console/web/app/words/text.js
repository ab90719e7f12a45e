// The page's words in the language in use.

import en from "./en.js";
import es from "./es.js";

const LISTS = { en, es };
let language = "en";

/** Languages that the page speaks, with their own names. */
export const LANGUAGES = { en: "English", es: "Español" };

export function currentLanguage() {
  return language;
}

export function setLanguage(next) {
  language = next in LISTS ? next : "en";
}

/** The words of `key` with {name} filled in. A key that is not there shows itself, which the tests refuse. */
export function t(key, values = {}) {
  const words = LISTS[language][key] ?? en[key] ?? key;
  return words.replace(/\{(\w+)\}/g, (whole, name) => (name in values ? String(values[name]) : whole));
}

/** A sentence with its first letter large. */
export function capital(words) {
  return words.charAt(0).toUpperCase() + words.slice(1);
}

/** A number as the language writes it. */
export function number(value, digits = 0) {
  return new Intl.NumberFormat(language, { minimumFractionDigits: digits, maximumFractionDigits: digits }).format(value);
}

/** A number that comes as text with a point ("0.3"). */
export function written(text) {
  return language === "es" ? text.replace(".", ",") : text;
}

/** A moment, day and time, of the reader's own clock. */
export function moment(value) {
  const date = new Date(value);
  if (Number.isNaN(date.getTime())) return "";
  return new Intl.DateTimeFormat(language, { dateStyle: "medium", timeStyle: "short", hourCycle: "h23" }).format(date);
}

export function timeOfDay(value) {
  return new Intl.DateTimeFormat(language, { hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" }).format(new Date(value));
}
