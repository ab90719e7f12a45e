// Changing one's own password.

import * as api from "../net/api.js";
import { h, fill, icon } from "./dom.js";
import { field, form, newPassword } from "./form.js";
import { ApiError } from "../net/api.js";
import { t } from "../words/text.js";

export function passwordView() {
  const done = h("div", { role: "status" });
  const element = h("div", { class: "page narrow" },
    h("div", { class: "page-head" }, h("h1", {}, t("nav.password"))),
    h("div", { class: "card" }, form([
      field(t("password.old"), "old", { type: "password", autocomplete: "current-password" }),
      newPassword(t("password.new"), "next"),
      field(t("password.again"), "again", { type: "password", autocomplete: "new-password" }),
      done,
    ], t("password.go"), async ({ old, next, again }, element) => {
      fill(done);
      if (next !== again) throw new ApiError(400, t("password.differ"));
      await api.changePassword(old, next);
      element.reset();
      fill(done, h("p", { class: "note good" }, icon("check"), h("span", {}, t("password.done"))));
    })));
  return { element, title: t("nav.password") };
}
