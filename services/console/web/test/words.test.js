// Both languages are complete, every word that is used exists, and every word that exists is used.

import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { test } from "node:test";
import * as codes from "../app/pure/codes.js";
import en from "../app/words/en.js";
import es from "../app/words/es.js";
import rules from "../app/words/sentences-es.js";
import { sentence } from "../app/words/sentences.js";
import { setLanguage, t } from "../app/words/text.js";

const app = new URL("../app/", import.meta.url);
const sources = readdirSync(app, { recursive: true }).filter((name) => name.endsWith(".js") && !/words\/(en|es)\.js$/.test(name)).map((name) => readFileSync(new URL(name, app), "utf8"));
const holes = (words) => [...words.matchAll(/\{(\w+)\}/g)].map((match) => match[1]).sort();

test("Spanish and English have the same words with the same holes", () => {
  assert.deepEqual(Object.keys(es).sort(), Object.keys(en).sort());
  for (const key of Object.keys(en)) {
    assert.deepEqual(holes(es[key]), holes(en[key]), key);
    assert.ok(es[key].trim() && en[key].trim(), key);
  }
});

test("every word that a module names exists", () => {
  let named = 0;
  for (const source of sources) {
    for (const [, key] of source.matchAll(/\bt\(\s*"([\w.-]+)"/g)) {
      assert.ok(key in en, key);
      named += 1;
    }
    // A key with a part filled in: at least one word must begin and end so.
    for (const [, template] of source.matchAll(/\bt\([^`"\n]*`([\w.${}[\]()?, -]+)`/g)) {
      const pattern = new RegExp(`^${template.replace(/\$\{[^}]*\}/g, "[\\w-]+").replaceAll(".", "\\.")}$`);
      assert.ok(Object.keys(en).some((key) => pattern.test(key)), template);
      named += 1;
    }
  }
  assert.ok(named > 250, `${named}`);
});

test("every word that exists is used", () => {
  const all = sources.join("\n");
  const unused = Object.keys(en).filter((key) => {
    if (all.includes(`"${key}"`)) return false;
    // Made from a code: `phase.${...}`, `event.room_${...}`.
    return ![key.replace(/[^.]+$/, "${"), key.replace(/[^._]+$/, "${")].some((stem) => all.includes(`\`${stem}`));
  });
  assert.deepEqual(unused, []);
});

test("every code of the drone has a word", () => {
  const families = { PHASES: ["phase"], STICKS: ["sticks.state", "sticks.hint"], ROOMS: ["room"], REASONS: ["reason"], ACTIONS: ["then", "does", "action"] };
  for (const [list, prefixes] of Object.entries(families)) {
    for (const word of codes[list]) for (const prefix of prefixes) assert.ok(`${prefix}.${word}` in en, `${prefix}.${word}`);
  }
  for (const word of codes.CAUSES.slice(1)) assert.ok(`cause.${word}` in en, word);
  for (const word of codes.PATROL.slice(1)) assert.ok(`round.${word}` in en, word);
});

test("whatever the pilot says of the sticks and of orders has a Spanish sentence", () => {
  const folder = new URL("../../../pilot/src/", import.meta.url);
  const files = readdirSync(folder).filter((name) => name.endsWith(".rs"));
  const source = files.map((name) => readFileSync(new URL(name, folder), "utf8").split("#[cfg(test)]")[0]).join("");
  const said = [...source.matchAll(/\b(?:refused|say|Ok)\(\s*"([^"{}]+)"/g)].map((match) => match[1]);
  assert.ok(said.length > 20, "the pilot says more than that");
  for (const text of said) assert.notEqual(sentence(text, "es"), text, text);
  for (const text of said.filter((text) => text.startsWith("refused: "))) {
    const [, why] = text.split("refused: ");
    assert.notEqual(sentence(why, "es"), why, text);
  }
});

test("sentences of the drone are said in Spanish, parts within parts", () => {
  setLanguage("es");
  assert.equal(sentence("refused: not flying"), "rechazado: no está volando");
  assert.equal(sentence("refused: battery at 3.61 V a cell, 3.70 needed"), "rechazado: batería a 3.61 V por celda; hacen falta 3.70");
  assert.equal(sentence("looking at Kitchen: place 3 of 22: something stands in the way, waiting for it to move on"), "mirando Kitchen: punto 3 de 22; algo corta el paso, se espera a que se aparte");
  assert.equal(sentence("accepted: pilot the sticks are yours: stopping first; navigation paused"), "aceptado: piloto: los mandos son suyos: primero se detiene; navegación: en pausa");
  assert.equal(sentence("on the ground; something new"), "en el suelo; something new");
  assert.equal(sentence("a sentence nobody foresaw"), "a sentence nobody foresaw");
  assert.equal(sentence(""), "");
  assert.equal(sentence("refused: not flying", "en"), "refused: not flying");
  setLanguage("en");
});

test("a rule fills only holes that its English has", () => {
  for (const [english, spanish] of rules) for (const hole of holes(spanish)) assert.ok(holes(english).includes(hole), `${english}: ${hole}`);
  assert.equal(new Set(rules.map(([english]) => english)).size, rules.length);
});

test("holes are filled, unknown ones stay", () => {
  setLanguage("es");
  assert.equal(t("round.count", { done: 2, all: 9 }), "2 de 9 salas");
  assert.equal(t("round.count", { done: 2 }), "2 de {all} salas");
  setLanguage("en");
});
