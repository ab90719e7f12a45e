// What the drone and the console say in English sentences, in the reader's language. What is not known here is shown as it came:
// a sentence in a foreign language is worth more to a guard than none.

import rules from "./sentences-es.js";
import { currentLanguage } from "./text.js";

const compiled = rules.map(([english, spanish]) => ({
  pattern: new RegExp(`^${english.split(/\{\w+\}/).map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("(.+?)")}$`, "i"),
  spanish,
  names: [...english.matchAll(/\{(\w+)\}/g)].map((match) => match[1]),
}));

/** The sentence in `language`. Parts after "; " and ": " are looked up by themselves when the whole is not known. */
export function sentence(text, language = currentLanguage()) {
  if (language !== "es" || !text) return text;
  return known(text) ?? text;
}

function known(text) {
  return whole(text) ?? parts(text, "; ") ?? parts(text, ": ");
}

function whole(text) {
  for (const { pattern, spanish, names } of compiled) {
    const match = pattern.exec(text.trim());
    if (!match) continue;
    return spanish.replace(/\{(\w+)\}/g, (_, name) => {
      const value = match[1 + names.indexOf(name)] ?? "";
      return known(value) ?? value;
    });
  }
  return null;
}

function parts(text, separator) {
  const list = text.split(separator);
  if (list.length < 2) return null;
  const translated = list.map((part) => whole(part));
  if (translated.every((part) => part === null)) return null;
  return translated.map((part, k) => part ?? list[k]).join(separator);
}
