// Reports of rounds: the list, and one that can be printed.

import * as api from "../net/api.js";
import { h, button, fill, icon } from "./dom.js";
import { empty } from "./drones.js";
import { play } from "./recordings.js";
import { trouble } from "./form.js";
import { clock } from "../pure/age.js";
import { list } from "../pure/lists.js";
import { clipsOf, recordingsOf } from "../pure/recording.js";
import { outcomeOf, reportOf } from "../pure/report.js";
import { sentence } from "../words/sentences.js";
import { capital, moment, number, t, timeOfDay } from "../words/text.js";

const TONE = { good: "ok", caution: "caution", alarm: "alarm" };

function outcomePill(outcome) {
  const { key, tone } = outcomeOf(outcome);
  return h("span", { class: `pill ${TONE[tone]}` }, key ? t(key) : sentence(outcome));
}

function coverageBar(share) {
  return h("span", { class: "share" }, h("meter", { min: 0, max: 1, value: share, "aria-label": t("reports.coverage") }), h("span", {}, `${number(100 * share)} %`));
}

export function reportsView(session) {
  const body = h("div", { class: "card table-wrap", "aria-live": "polite" });
  const load = async () => {
    try {
      const reports = list(await api.reports(), "reports");
      if (reports.length === 0) {
        fill(body, empty("report", t("reports.none"), t("reports.none_words"), h("a", { class: "button primary", href: "#/" }, t("reports.to_watch"))));
        return;
      }
      fill(body, h("table", { class: "table" },
        h("thead", {}, h("tr", {}, [t("reports.when"), t("reports.drone"), t("reports.length"), t("reports.coverage"), t("reports.outcome"), ""].map((words) => h("th", { scope: "col" }, words || h("span", { class: "unseen" }, t("reports.open")))))),
        h("tbody", {}, reports.map((line) => h("tr", {},
          h("td", {}, h("strong", {}, moment(line.started_ms))),
          h("td", { "data-name": t("reports.drone") }, line.drone),
          h("td", { "data-name": t("reports.length") }, `${clock((line.landed_ms - line.started_ms) / 1000)} min`),
          h("td", { "data-name": t("reports.coverage") }, coverageBar(line.coverage)),
          h("td", {}, outcomePill(line.outcome)),
          h("td", { class: "number" }, h("a", { class: "button", href: `#/reports/${line.id}`, "aria-label": `${t("reports.open")}: ${moment(line.started_ms)}` }, t("reports.open"))))))));
    } catch (error) {
      fill(body, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error))));
    }
  };
  load();
  return {
    element: h("div", { class: "page" }, h("div", { class: "page-head" }, h("div", {}, h("h1", {}, t("nav.reports")), h("p", {}, t("reports.words")))), body),
    title: t("nav.reports"), session,
  };
}

function figure(words, value) {
  return h("div", {}, h("dt", {}, words), h("dd", {}, value));
}

function roomRow(room) {
  return h("tr", {},
    h("td", {}, h("strong", {}, room.name)),
    h("td", { "data-name": t("reports.state") }, h("span", { class: `pill ${{ seen: "ok", partly: "caution", skipped: "alarm" }[room.state] ?? ""}` }, t({ waiting: "report.not_reached", entered: "report.not_finished" }[room.state] ?? `room.${room.state}`))),
    h("td", { "data-name": t("reports.coverage") }, coverageBar(room.seen)),
    h("td", { "data-name": t("reports.times") }, [room.entered_ms, room.left_ms].filter(Boolean).map(timeOfDay).join(" – ") || "–"),
    h("td", { "data-name": t("reports.reason") }, room.reason ? sentence(room.reason) : ""));
}

/** A heading with what lasted for a while below it; nothing when nothing did. */
function spans(title, list) {
  if (list.length === 0) return null;
  return [h("h2", {}, title), h("ul", { class: "incidents" }, list.map((line) => h("li", {},
    h("time", {}, timeOfDay(line.time_ms)),
    h("div", {}, h("strong", {}, [line.text, line.action].filter(Boolean).map((words) => sentence(words)).join(": ")),
      h("span", { class: "quiet" }, line.ended_ms ? t("report.for", { time: clock((line.ended_ms - line.time_ms) / 1000) }) : t("report.to_the_end"))))))];
}

function paper(report) {
  return [
    h("header", { class: "paper-head" },
      h("img", { src: "/app/mark.svg", alt: "" }),
      h("div", {}, h("h1", {}, t("report.title")), h("p", {}, `${report.drone} · ${moment(report.started_ms)}`)),
      outcomePill(report.outcome)),
    h("dl", { class: "figures" },
      figure(t("report.started"), moment(report.started_ms)),
      figure(t("report.landed"), moment(report.landed_ms)),
      figure(t("reports.length"), `${clock((report.landed_ms - report.started_ms) / 1000)} min`),
      figure(t("reports.coverage"), `${number(100 * report.coverage)} %`)),
    report.text ? h("p", { class: "quiet" }, capital(sentence(report.text))) : null,
    h("h2", {}, t("report.rooms")),
    report.rooms.length > 0
      ? h("table", { class: "table" }, h("thead", {}, h("tr", {}, [t("reports.room"), t("reports.state"), t("reports.coverage"), t("reports.times"), t("reports.reason")].map((words) => h("th", { scope: "col" }, words)))), h("tbody", {}, report.rooms.map(roomRow)))
      : h("p", { class: "quiet" }, t("report.no_rooms")),
    h("h2", {}, t("report.incidents")),
    report.incidents.length > 0
      ? h("ol", { class: "incidents" }, report.incidents.map((incident) => h("li", { data: { incident: incident.id ?? "" } }, h("time", {}, timeOfDay(incident.time_ms)), h("div", {}, h("strong", {}, incident.text || t("report.incident")),
          h("span", { class: "quiet" }, [incident.account, incident.x_m === null ? "" : t("report.at", { x: number(incident.x_m, 1), y: number(incident.y_m, 1) })].filter(Boolean).join(" · "))))))
      : h("p", { class: "quiet" }, t("report.no_incidents")),
    spans(t("report.failsafes"), report.failsafes),
    spans(t("report.flown_by"), report.flown_by),
    spans(t("report.silences"), report.silences),
  ];
}

/** Puts the pictures that were kept beside each incident, for who may see them. */
async function addClips(body, report) {
  const recordings = recordingsOf(await api.recordings(report.drone));
  for (const incident of report.incidents) {
    const clips = clipsOf(incident.id, recordings);
    body.querySelector(`[data-incident="${Number(incident.id)}"]`)?.append(h("span", { class: "row-actions no-print" }, clips.map((one) =>
      button(t("report.clip"), "play", { "aria-label": `${t("report.clip")}: ${timeOfDay(incident.time_ms)}`, onclick: () => play(report.drone, one) }))));
  }
}

export function reportView(id, session) {
  const body = h("article", { class: "card paper", "aria-live": "polite" });
  api.report(id).then(
    (value) => {
      const report = reportOf(value);
      fill(body, paper(report));
      // Without them the report is what it is.
      if (session.account.role !== "viewer" && session.recording?.keeps && report.incidents.length > 0) addClips(body, report).catch(() => {});
    },
    (error) => fill(body, h("p", { class: "note bad" }, icon("alert"), h("span", {}, trouble(error)))),
  );
  return {
    element: h("div", { class: "page" },
      h("div", { class: "page-head no-print" },
        h("a", { class: "button plain", href: "#/reports" }, icon("back"), t("nav.reports")),
        button(t("report.print"), "print", { class: "primary", onclick: () => print() })),
      body),
    title: t("report.title"),
  };
}
