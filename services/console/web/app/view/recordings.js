// Recordings of a drone: played, taken away and, by an administrator, erased.

import * as api from "../net/api.js";
import { h, button, fill, icon } from "./dom.js";
import { openDialog } from "./dialog.js";
import { empty } from "./drones.js";
import { form, trouble } from "./form.js";
import { clock } from "../pure/age.js";
import { lengthOf, recordingsOf, sizeParts } from "../pure/recording.js";
import { moment, number, t } from "../words/text.js";

/** An open recording grows: the list is read again so often while there is one. */
const AGAIN_MS = 5000;

function sizeWords(bytes) {
  const { key, value, digits } = sizeParts(bytes);
  return `${number(value, digits)} ${t(`recordings.${key}`)}`;
}

function nameOf(one) {
  return one.parts > 1 ? `${moment(one.started_ms)} · ${t("recordings.part", { part: one.part, parts: one.parts })}` : moment(one.started_ms);
}

/** Shows a recording in a dialog. */
export function play(drone, one) {
  openDialog(nameOf(one), () => {
    const told = h("p", { class: "note bad", role: "alert", hidden: true }, icon("alert"), h("span", {}, t("recordings.unplayable")));
    const film = h("video", { class: "film", controls: true, playsinline: true, autoplay: true, src: api.filmUrl(drone, one.id), "aria-label": t("recordings.film", { drone, when: nameOf(one) }) });
    // It has no sound, and browsers let the silent play at once.
    film.muted = true;
    film.addEventListener("error", () => { told.hidden = false; });
    return h("div", { class: "film-place" }, film, told);
  });
}

function askErase(drone, one, done) {
  openDialog(t("recordings.erase_ask"), (close) => form(
    [h("p", {}, t("recordings.erase_words", { when: nameOf(one), drone }))],
    t("recordings.erase"),
    async () => {
      await api.eraseRecording(drone, one.id);
      close();
      done();
    },
    [button(t("app.cancel"), null, { class: "plain", onclick: close })],
  ));
}

function row(drone, one, administrator, again) {
  const length = lengthOf(one);
  const when = nameOf(one);
  return h("tr", {},
    h("td", {}, h("strong", {}, when), one.incident ? h("span", { class: "pill caution" }, t("recordings.incident", { number: one.incident })) : null),
    h("td", { class: "figure", "data-name": t("recordings.length") }, length === null ? h("span", { class: "pill alarm" }, t("recordings.open")) : `${clock(length)} min`),
    h("td", { class: "figure", "data-name": t("recordings.picture") }, `${one.width} × ${one.height}`),
    h("td", { class: "figure", "data-name": t("recordings.size") }, length === null ? "–" : sizeWords(one.bytes)),
    h("td", { "data-name": t("recordings.who") }, one.account),
    h("td", { class: "number" }, h("div", { class: "row-actions" },
      button(t("recordings.play"), "play", { "aria-label": `${t("recordings.play")}: ${when}`, onclick: () => play(drone, one) }),
      h("a", { class: "button", href: `${api.filmUrl(drone, one.id)}?download`, download: true, "aria-label": `${t("recordings.download")}: ${when}` }, icon("download"), h("span", { class: "label" }, t("recordings.download"))),
      administrator && length !== null ? button(t("recordings.erase"), "trash", { class: "danger", "aria-label": `${t("recordings.erase")}: ${when}`, onclick: () => askErase(drone, one, again) }) : null)));
}

export function recordingsView(asked, session) {
  const { drones, recording } = session;
  const administrator = session.account.role === "administrator";
  const drone = drones.includes(asked) ? asked : drones[0];
  const body = h("div", { class: "card table-wrap", "aria-live": "polite" });
  let timer = null;
  let shown = "";
  const load = async () => {
    clearTimeout(timer);
    try {
      const answer = await api.recordings(drone);
      const all = recordingsOf(answer);
      if (all.some((one) => lengthOf(one) === null)) timer = setTimeout(load, AGAIN_MS);
      // What is unchanged is left alone: focus stays where it is.
      const text = JSON.stringify(all);
      if (text === shown) return;
      shown = text;
      if (all.length === 0) {
        fill(body, empty("record", t("recordings.none"), t(recording?.keeps ? "recordings.none_words" : "record.keeps_none")));
        return;
      }
      const heads = ["when", "length", "picture", "size", "who"].map((key) => h("th", { scope: "col" }, t(`recordings.${key}`)));
      fill(body, h("table", { class: "table" },
        h("thead", {}, h("tr", {}, heads, h("th", { scope: "col" }, h("span", { class: "unseen" }, t("recordings.deeds"))))),
        h("tbody", {}, all.map((one) => row(drone, one, administrator, load)))));
    } catch (error) {
      fill(body, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    }
  };
  if (drone) load();
  else fill(body, empty("drone", t("none.title"), t("none.words")));
  const choose = drones.length > 1
    ? h("label", { class: "field" }, h("span", {}, t("recordings.drone")), h("select", { class: "select", onchange: (event) => { location.hash = `#/recordings/${encodeURIComponent(event.target.value)}`; } }, drones.map((name) => h("option", { value: name, selected: name === drone }, name))))
    : null;
  const kept = recording?.keeps ? t("recordings.kept", { days: number(recording.retention_h / 24, recording.retention_h % 24 ? 1 : 0) }) : t("record.keeps_none");
  return {
    element: h("div", { class: "page" }, h("div", { class: "page-head" }, h("div", {}, h("h1", {}, t("nav.recordings")), h("p", {}, kept)), choose), body),
    title: t("nav.recordings"),
    end: () => clearTimeout(timer),
  };
}
