// Forms: labelled fields, one sentence of trouble, a button that waits.

import { h, button, fill, icon } from "./dom.js";
import { sentence } from "../words/sentences.js";
import { t } from "../words/text.js";

/** A labelled input. `hint` stands below it. */
export function field(label, name, properties = {}, hint = null) {
  return h("label", { class: "field" }, h("span", {}, label), h("input", { class: "input", name, required: true, ...properties }), hint ? h("small", {}, hint) : null);
}

/** A labelled choice of [value, words]. */
export function choice(label, name, options, chosen) {
  return h("label", { class: "field" }, h("span", {}, label),
    h("select", { class: "select", name }, options.map(([value, words]) => h("option", { value, selected: value === chosen }, words))));
}

export function trouble(error) {
  if (error.status === 0) return t("error.unreachable");
  return error.message ? sentence(error.message) : t("error.status", { status: error.status });
}

/** A form that gives `submit` its fields as an object and shows what went wrong. */
export function form(parts, submitLabel, submit, more = []) {
  const place = h("div", { role: "alert" });
  const go = button(submitLabel, null, { class: "primary", type: "submit" });
  return h("form", { class: "form", onsubmit: async (event) => {
    event.preventDefault();
    const values = Object.fromEntries(new FormData(event.currentTarget));
    go.disabled = true;
    fill(place);
    try {
      await submit(values, event.target);
    } catch (error) {
      fill(place, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    } finally {
      go.disabled = false;
    }
  } }, parts, place, more.length > 0 ? h("div", { class: "dialog-actions" }, more, go) : go);
}

/** Least length of a password, as the console asks. */
export const PASSWORD_LEAST = 12;

export function newPassword(label, name) {
  return field(label, name, { type: "password", autocomplete: "new-password", minlength: PASSWORD_LEAST, maxlength: 256 }, t("form.password_hint", { least: PASSWORD_LEAST }));
}
