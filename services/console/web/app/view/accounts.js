// Accounts, for administrators: who there is, what each may do and which drones each may fly.

import * as api from "../net/api.js";
import { h, button, fill, icon } from "./dom.js";
import { choice, field, form, newPassword, trouble } from "./form.js";
import { openDevices } from "./devices.js";
import { openDialog } from "./dialog.js";
import { list } from "../pure/lists.js";
import { t } from "../words/text.js";

const ROLES = ["viewer", "guard", "installer", "administrator"];
const ROLE_TONE = { viewer: "", guard: "info", installer: "info", administrator: "lamp" };
/** Stands for all drones, also those that come later. */
const EVERY = "*";

function roleChoice(chosen) {
  return choice(t("accounts.role"), "role", ROLES.map((role) => [role, t(`role.${role}`)]), chosen);
}

function roleHints() {
  return h("dl", { class: "hints" }, ROLES.map((role) => [h("dt", {}, t(`role.${role}`)), h("dd", {}, t(`role_hint.${role}`))]));
}

function droneChoice(names, chosen) {
  const known = [...new Set([...names, ...chosen.filter((name) => name !== EVERY)])];
  const every = h("input", { type: "checkbox", name: "every", checked: chosen.includes(EVERY) });
  const single = known.map((name) => h("input", { type: "checkbox", name: "drone", value: name, checked: chosen.includes(name) }));
  const reflect = () => single.forEach((box) => { box.disabled = every.checked; });
  every.addEventListener("change", reflect);
  reflect();
  return {
    element: h("fieldset", { class: "field" }, h("legend", {}, t("accounts.drones")),
      h("label", { class: "switch" }, every, h("span", {}, t("accounts.every_drone"))),
      single.map((box) => h("label", { class: "switch" }, box, h("span", {}, box.value)))),
    value: () => (every.checked ? [EVERY] : single.filter((box) => box.checked).map((box) => box.value)),
  };
}

function dronesOf(account) {
  if (account.drones.includes(EVERY)) return t("accounts.every_drone");
  return account.drones.length > 0 ? account.drones.join(", ") : t("accounts.no_drone");
}

export function accountsView(session) {
  const body = h("div", { class: "card table-wrap", "aria-live": "polite" });
  let names = session.drones;

  const create = () => openDialog(t("accounts.new"), (close) => {
    const drones = droneChoice(names, []);
    return form([
      h("div", { class: "pair" }, field(t("form.name"), "name", { maxlength: 80, autofocus: true, autocomplete: "off" }), field(t("form.surname"), "surname", { maxlength: 80, autocomplete: "off" })),
      field(t("form.email"), "email", { type: "email", maxlength: 254, autocomplete: "off" }),
      newPassword(t("accounts.first_password"), "password"),
      roleChoice("guard"), roleHints(), drones.element,
    ], t("accounts.create"), async ({ name, surname, email, password, role }) => {
      await api.createAccount({ name, surname, email, password, role, drones: drones.value() });
      close();
      await load();
    }, [button(t("app.cancel"), null, { class: "plain", onclick: close })]);
  });

  const edit = (account) => openDialog(`${account.name} ${account.surname}`, (close) => {
    const drones = droneChoice(names, account.drones);
    const disabled = h("input", { type: "checkbox", checked: account.disabled });
    const self = account.id === session.account.id;
    disabled.disabled = self;
    return form([
      h("p", { class: "quiet" }, account.email),
      roleChoice(account.role), roleHints(), drones.element,
      h("label", { class: "switch" }, disabled, h("span", {}, t("accounts.disabled"))),
      h("label", { class: "field" }, h("span", {}, t("accounts.new_password")),
        h("input", { class: "input", type: "password", name: "password", autocomplete: "new-password", minlength: 12, maxlength: 256 }), h("small", {}, t("accounts.new_password_hint"))),
    ], t("app.save"), async ({ role, password }) => {
      const change = { role, drones: drones.value(), disabled: disabled.checked };
      if (password) change.password = password;
      await api.changeAccount(account.id, change);
      close();
      if (self) dispatchEvent(new Event("sereno:session"));
      else await load();
    }, [button(t("app.cancel"), null, { class: "plain", onclick: close })]);
  });

  const row = (account) => h("tr", { data: { off: String(account.disabled) } },
    h("td", { class: "who" }, h("strong", {}, `${account.name} ${account.surname}`), h("span", {}, account.email)),
    h("td", { "data-name": t("accounts.role") }, h("span", { class: `pill ${ROLE_TONE[account.role] ?? ""}` }, t(`role.${account.role}`))),
    h("td", { "data-name": t("accounts.drones") }, dronesOf(account)),
    h("td", {}, account.disabled ? h("span", { class: "pill alarm" }, t("accounts.is_disabled")) : null),
    h("td", { class: "number" }, button(t("app.change"), null, { "aria-label": `${t("app.change")}: ${account.name} ${account.surname}`, onclick: () => edit(account) })));

  async function load() {
    try {
      const [accounts, drones] = await Promise.all([api.accounts(), api.drones()]);
      names = list(drones, "drones").map((drone) => drone.name);
      fill(body, h("table", { class: "table" },
        h("thead", {}, h("tr", {}, [t("accounts.person"), t("accounts.role"), t("accounts.drones"), t("accounts.state"), ""].map((words) => h("th", { scope: "col" }, words || h("span", { class: "unseen" }, t("app.change")))))),
        h("tbody", {}, list(accounts, "accounts").map(row))));
    } catch (error) {
      fill(body, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    }
  }
  load();
  return {
    element: h("div", { class: "page" },
      h("div", { class: "page-head" }, h("div", {}, h("h1", {}, t("nav.accounts")), h("p", {}, t("accounts.words"))), h("div", { class: "actions" }, button(t("devices.open"), "shield", { onclick: openDevices }), button(t("accounts.new"), "plus", { class: "primary", onclick: create }))),
      body),
    title: t("nav.accounts"),
  };
}
