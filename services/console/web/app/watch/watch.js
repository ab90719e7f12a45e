// The watch room for one drone: its panels side by side, and on a phone one after the other.

import { h, setData, show } from "../view/dom.js";
import { t } from "../words/text.js";
import { AlarmPanel, wakeSound } from "./alarm.js";
import { DockPanel } from "./dock.js";
import { layersMenu } from "./layers.js";
import { LinkPanel, linkState } from "./link.js";
import { ManualPanel } from "./manual.js";
import { PlanPanel } from "./plan.js";
import { PolarPanel } from "./polar.js";
import { RecordBar } from "./record.js";
import { WatchSession } from "./session.js";
import { SituationPanel } from "./situation.js";
import { EventsPanel, GaugesPanel, LossesPanel, RoundPanel } from "./status.js";
import { VideoPanel } from "./video.js";

/** Panels are looked at so often, and at once when the pilot says something. */
const LOOK_MS = 200;
/** The watch goes on behind every other view: who reads a report must still hear an alarm. */
let standing = null;
let watched = 0;

function sessionFor(drone, account) {
  const same = standing && standing.drone === drone && standing.account.id === account.id && standing.account.role === account.role;
  if (!same) {
    endWatch();
    standing = new WatchSession(drone, account);
  }
  return standing;
}

/** Nobody watches any more: logged out, or another drone. */
export function endWatch() {
  standing?.end();
  standing = null;
}

/** The alarm of the watch that goes on, for another view: {element, end}, or null without one. */
export function alarmElsewhere() {
  if (!standing) return null;
  const session = standing;
  const alarm = new AlarmPanel(session, true);
  const update = () => alarm.update();
  const timer = setInterval(update, LOOK_MS);
  update();
  return { element: alarm.element, end: () => clearInterval(timer) };
}

export function watchView(drone, { account, drones, recording = { keeps: false } }) {
  const session = sessionFor(drone, account);
  watched += 1;
  const plan = new PlanPanel(session);
  const situation = new SituationPanel(session);
  const alarm = new AlarmPanel(session);
  const video = new VideoPanel(session);
  const record = new RecordBar(session, recording);
  video.foot.append(record.element);
  const gauges = new GaugesPanel(session);
  const losses = new LossesPanel(session);
  const round = new RoundPanel(session);
  const events = new EventsPanel(session);
  const polar = new PolarPanel(session);
  const link = new LinkPanel(session, drones);
  const dock = new DockPanel(session, plan, { sticks: () => setManual(!manual), keeps: recording });
  const manualPlace = h("div", { class: "manual-place" });
  let manual = null;

  plan.tools.prepend(layersMenu(session));
  plan.above = () => situation.element.offsetTop + situation.element.offsetHeight;
  const sizes = new ResizeObserver(() => plan.refit());
  sizes.observe(situation.element);
  const veil = h("p", { class: "veil", role: "status" });
  const stage = h("div", { class: "stage" }, plan.element, situation.element, veil);
  const side = h("div", { class: "side" }, manualPlace, video.element, gauges.element, polar.element, losses.element);
  const more = h("div", { class: "more" }, round.element, events.element);
  const tabs = ["plan", "video", "round", "log"].map((name) => h("button", { type: "button", onclick: () => setTab(name) }, t(`tab.${name}`)));
  const tabBar = h("div", { class: "segments tabs", role: "group", "aria-label": t("tab.name") }, tabs);
  const element = h("div", { class: "watch", data: { tab: "plan" } }, alarm.element, tabBar, stage, h("div", { class: "column" }, side, more), dock.element);

  function setTab(name) {
    setData(element, "tab", name);
    tabs.forEach((tab, k) => tab.setAttribute("aria-pressed", String(["plan", "video", "round", "log"][k] === name)));
  }
  setTab("plan");

  function setManual(open) {
    if (open && session.control) {
      session.control.begin();
      manual = new ManualPanel(session, () => setManual(false));
      manualPlace.replaceChildren(manual.element);
      manual.take.focus({ preventScroll: true });
      setTab("plan");
      plan.setFollow(true);
    } else {
      manual?.end();
      manual = null;
      session.control?.finish();
      plan.fit();
      manualPlace.replaceChildren();
      dock.sticks.focus({ preventScroll: true });
    }
    setData(element, "manual", Boolean(manual));
    update();
  }

  function update() {
    const now = performance.now();
    const state = linkState(session.telemetry, now);
    setData(element, "link", state);
    veil.textContent = state === "live" || state === "late" ? "" : t(`veil.${state}`);
    show(veil, veil.textContent !== "");
    show(polar.element, session.layers.has("polar"));
    for (const panel of [alarm, situation, link, video, record, gauges, losses, round, events, polar, dock, manual]) panel?.update(now);
  }
  const dirty = () => { plan.dirty = true; };
  const listeners = [
    ["about", () => plan.load()], ["about", update], ["link", update], ["recording", update], ["layers", dirty], ["layers", update], ["pilot/state", update],
    ["navigation/patrol", dirty], ["navigation/grid", dirty], ["localization/particles", dirty], ["localization/pose", dirty], ["navigation/polar", () => polar.update()],
  ];
  for (const [name, handler] of listeners) session.addEventListener(name, handler);
  addEventListener("pointerdown", wakeSound);
  addEventListener("keydown", wakeSound);
  const timer = setInterval(update, LOOK_MS);
  if (session.control?.open) setManual(true);
  else update();

  return {
    element,
    bar: link.element,
    title: drone,
    end() {
      clearInterval(timer);
      sizes.disconnect();
      for (const [name, handler] of listeners) session.removeEventListener(name, handler);
      removeEventListener("pointerdown", wakeSound);
      removeEventListener("keydown", wakeSound);
      manual?.end();
      plan.end();
      video.end();
      // When only words change the next view is drawn in the same turn of the loop, and the sticks stay in hand.
      watched -= 1;
      queueMicrotask(() => {
        if (watched === 0) session.control?.finish();
      });
    },
  };
}
