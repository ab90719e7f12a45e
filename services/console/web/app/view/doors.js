// The two doors: claiming a new console, and logging in.

import * as api from "../net/api.js";
import { h } from "./dom.js";
import { field, form, newPassword } from "./form.js";
import { languageSwitch, themeButton } from "./frame.js";
import { currentLanguage, t } from "../words/text.js";

function door(title, words, inside) {
  return h("main", { class: "door", id: "view", tabindex: "-1" },
    h("div", { class: "door-inner" },
      h("div", { class: "door-head" }, h("img", { src: "/app/mark.svg", alt: "" }), h("h1", {}, title), h("p", {}, words)),
      h("div", { class: "card" }, inside),
      h("div", { class: "door-foot" }, languageSwitch(), themeButton())));
}

export function loginView(done) {
  const element = door(t("login.title"), t("login.words"), form([
    field(t("form.email"), "email", { type: "email", autocomplete: "username", autofocus: true, maxlength: 254 }),
    field(t("form.password"), "password", { type: "password", autocomplete: "current-password", maxlength: 256 }),
  ], t("login.go"), async ({ email, password }) => {
    await api.login(email, password);
    await done();
  }));
  return { element, title: t("login.title") };
}

export function claimView(done) {
  const element = door(t("claim.title"), t("claim.words"), form([
    field(t("claim.code"), "code", { autocomplete: "off", autocapitalize: "characters", spellcheck: "false", autofocus: true, maxlength: 64 }, t("claim.code_hint")),
    h("div", { class: "pair" },
      field(t("form.name"), "name", { autocomplete: "given-name", maxlength: 80 }),
      field(t("form.surname"), "surname", { autocomplete: "family-name", maxlength: 80 })),
    field(t("form.email"), "email", { type: "email", autocomplete: "username", maxlength: 254 }),
    newPassword(t("form.password"), "password"),
  ], t("claim.go"), async (values) => {
    await api.claim({ ...values, code: values.code.trim() });
    const session = await api.session();
    if (!session.account) await api.login(values.email, values.password);
    await api.keepLanguage(currentLanguage()).catch(() => {});
    await done();
  }));
  return { element, title: t("claim.title") };
}
