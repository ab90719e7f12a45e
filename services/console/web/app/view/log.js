// The log: log-ins, log-outs, failed attempts and actions, newest first.

import * as api from "../net/api.js";
import { h, button, fill, icon } from "./dom.js";
import { empty } from "./drones.js";
import { trouble } from "./form.js";
import { list } from "../pure/lists.js";
import { sentence } from "../words/sentences.js";
import { moment, t } from "../words/text.js";

const PAGE = 100;
const TONE = { claimed: "lamp", "log-in": "ok", "log-out": "", failed: "alarm", accounts: "info", order: "lamp", incident: "caution", recording: "info" };

function row(line) {
  const kind = line.kind in TONE ? t(`log.kind.${line.kind}`) : line.kind;
  const verb = line.kind === "order" && t(`verb.${line.verb}`) !== `verb.${line.verb}` ? t(`verb.${line.verb}`) : sentence(line.verb ?? "");
  return h("tr", {},
    h("td", { class: "figure", "data-name": t("log.when") }, moment(line.time_ms)),
    h("td", {}, h("span", { class: `pill ${TONE[line.kind] ?? ""}` }, kind)),
    h("td", { class: "who" }, h("strong", {}, line.account || "–"), h("span", {}, [line.role ? t(`role.${line.role}`) : "", line.address].filter(Boolean).join(" · "))),
    h("td", {}, [line.drone, verb].filter(Boolean).join(" · ")),
    h("td", {}, line.answer ? sentence(line.answer) : ""));
}

export function logView() {
  const rows = h("tbody", {});
  const place = h("div", { "aria-live": "polite" });
  const more = button(t("log.more"), null, { hidden: true, onclick: () => load() });
  let before = null;
  async function load() {
    more.disabled = true;
    try {
      const lines = list(await api.log(before, PAGE), "lines");
      for (const line of lines) rows.append(row(line));
      before = lines.at(-1)?.id ?? before;
      more.hidden = lines.length < PAGE;
      fill(place, rows.children.length === 0 ? empty("list", t("log.none"), t("log.none_words")) : null);
    } catch (error) {
      fill(place, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    } finally {
      more.disabled = false;
    }
  }
  load();
  return {
    element: h("div", { class: "page" },
      h("div", { class: "page-head" }, h("div", {}, h("h1", {}, t("nav.log")), h("p", {}, t("log.words")))),
      h("div", { class: "card table-wrap" },
        h("table", { class: "table" },
          h("thead", {}, h("tr", {}, [t("log.when"), t("log.kind"), t("log.who"), t("log.what"), t("log.answer")].map((words) => h("th", { scope: "col" }, words)))),
          rows),
        place),
      h("div", {}, more)),
    title: t("nav.log"),
  };
}
