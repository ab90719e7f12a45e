// The page's beginning: who is there, which view, in which language and light.

import * as api from "./net/api.js";
import { h, fill, loadIcons } from "./view/dom.js";
import { frame } from "./view/frame.js";
import { claimView, loginView } from "./view/doors.js";
import { accountsView } from "./view/accounts.js";
import { dronesView, noDroneView, troubleView } from "./view/drones.js";
import { logView } from "./view/log.js";
import { planView } from "./edit/view.js";
import { recordingsView } from "./view/recordings.js";
import { reportView, reportsView } from "./view/reports.js";
import { passwordView } from "./view/password.js";
import { alarmElsewhere, endWatch, watchView } from "./watch/watch.js";
import { begin as beginTheme } from "./view/theme.js";
import { begin as beginLanguage } from "./view/language.js";
import { t } from "./words/text.js";

const root = document.getElementById("app");
let session = null;
let view = null;
let alarm = null;

/** Where the address points: #/watch/NAME, #/plan/NAME, #/reports, #/reports/ID, #/recordings/NAME, #/accounts, #/log, #/password. */
function route() {
  const [name = "", argument = ""] = location.hash.replace(/^#\/?/, "").split("/");
  try {
    return { name, argument: decodeURIComponent(argument) };
  } catch {
    return { name, argument: "" };
  }
}

function choose() {
  if (!session.claimed) return { name: "claim", view: claimView(reload) };
  if (!session.account) return { name: "login", view: loginView(reload) };
  const { name, argument } = route();
  const administrator = session.account.role === "administrator";
  if (name === "reports") return { name, view: argument ? reportView(argument, session) : reportsView(session) };
  if (name === "recordings" && session.account.role !== "viewer") return { name, view: recordingsView(argument, session) };
  if (name === "accounts" && administrator) return { name, view: accountsView(session) };
  if (name === "log" && administrator) return { name, view: logView() };
  if (name === "password") return { name, view: passwordView() };
  if (session.drones.length === 0) return { name: "none", view: noDroneView(session) };
  if (name === "plan" && session.account.role !== "viewer" && session.drones.includes(argument)) return { name, view: planView(argument, session) };
  if (name === "watch" && session.drones.includes(argument)) return { name: "watch", view: watchView(argument, session) };
  if (session.drones.length === 1) return { name: "watch", view: watchView(session.drones[0], session) };
  return { name: "drones", view: dronesView() };
}

function draw() {
  view?.end?.();
  alarm?.end();
  const chosen = choose();
  view = chosen.view;
  document.title = view.title ? `${view.title} · Sereno` : "Sereno";
  const door = chosen.name === "claim" || chosen.name === "login";
  if (door) endWatch();
  alarm = door || chosen.name === "watch" ? null : alarmElsewhere();
  fill(root, door ? view.element : frame(chosen.name, session, view, alarm?.element ?? null, { out }));
  if (!door && view.focus !== false) document.getElementById("view")?.focus({ preventScroll: true });
}

async function out() {
  try {
    await api.logout();
  } catch {
    // Whatever happened, the session is asked for again below.
  }
  await reload();
}

/** Asks the console who is there and draws what follows from it. */
async function reload() {
  try {
    session = await api.session();
  } catch {
    view?.end?.();
    view = troubleView(reload);
    fill(root, view.element);
    return;
  }
  beginLanguage(session.account?.language, session.account !== null, draw);
  draw();
}

let staying = false;
addEventListener("hashchange", (event) => {
  if (staying || !session) {
    staying = false;
    return;
  }
  if (view?.leave && !view.leave()) {
    staying = true;
    location.replace(new URL(event.oldURL).hash);
    return;
  }
  draw();
});
addEventListener("sereno:session", reload);

fill(root, h("p", { class: "unseen", role: "status" }, t("app.loading")));
beginTheme();
loadIcons();
beginLanguage(null, false, draw);
reload();
