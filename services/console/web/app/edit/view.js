// The view "Round and plan": the plan large, what can be done with it beside, what will change and the way to use it below.

import { h, button, fill, icon, iconButton, setData, setText, show } from "../view/dom.js";
import { trouble } from "../view/form.js";
import { sentence } from "../words/sentences.js";
import { t } from "../words/text.js";
import { EditCanvas } from "./canvas.js";
import { Desk } from "./desk.js";
import { DraftPanel, askDistance, uploadPanel } from "./drafting.js";
import { Inspector } from "./inspector.js";
import { OrderList, ThingsList } from "./lists.js";
import { RehearsalPanel } from "./rehearsal.js";

const TOOLS = [["select", "hand"], ["points", "target"], ["no_fly", "shield"], ["privacy", "video-off"], ["rooms", "rooms"], ["pad", "home"]];
/** Changes named one by one; of more only their number. */
const NAMED = 6;

/** One desk a page; another drone or account clears it. */
let standing = null;

function deskFor(drone, account) {
  if (!standing || standing.drone !== drone || standing.account.id !== account.id || standing.account.role !== account.role) standing = new Desk(drone, account);
  return standing;
}

function changeWords({ what, kind, name }) {
  return t(`change.${what}`, { what: kind ? t(`edit.one.${kind}`) : "", name });
}

export function planView(drone, { account, drones }) {
  const desk = deskFor(drone, account);
  const inspector = new Inspector(desk);
  const canvas = new EditCanvas(desk, {
    measured: (a, b) => askDistance(desk, a, b, () => desk.setTool("select")),
    added: () => {
      inspector.name?.focus({ preventScroll: true });
      inspector.name?.select();
    },
  });
  const order = new OrderList(desk);
  const things = new ThingsList(desk, ["points", "no_fly", "privacy", "rooms", "doors"]);
  const drafting = new DraftPanel(desk, canvas);
  const rehearsal = desk.installer ? new RehearsalPanel(desk) : null;
  const upload = desk.installer ? uploadPanel(desk) : null;

  const tools = TOOLS.map(([name, iconName]) => button(t(`edit.tool.${name}`), iconName, { class: "tool", onclick: () => {
    desk.setTool(name);
    canvas.canvas.focus({ preventScroll: true });
  }, data: { tool: name } }));
  const shapes = h("div", { class: "segments shapes", role: "group", "aria-label": t("edit.shape") }, ["rectangle", "polygon"].map((shape) => h("button", { type: "button", onclick: () => desk.setTool(desk.tool, shape), data: { shape } }, t(`edit.shape.${shape}`))));
  const undo = iconButton(t("edit.undo"), "undo", { onclick: () => desk.undo() });
  const redo = iconButton(t("edit.redo"), "redo", { onclick: () => desk.redo() });
  const toolbar = h("div", { class: "edit-tools", role: "toolbar", "aria-label": t("edit.tools") }, tools, shapes, h("span", { class: "gap" }), undo, redo);

  const reason = h("p", { class: "note" }, icon("eye"), h("span", {}));
  const absent = h("p", { class: "note bad" }, icon("link-off"), h("span", {}));
  const summary = h("div", { class: "edit-summary", "aria-live": "polite" });
  const answer = h("div", { class: "edit-answer", role: "status" });
  const forget = button(t("edit.forget"), null, { class: "plain", onclick: () => {
    if (confirm(t("edit.forget_sure"))) desk.forget();
  } });
  const use = button(t("edit.use"), "check", { class: "primary", onclick: give });
  const foot = h("div", { class: "edit-foot" }, summary, answer, h("div", { class: "edit-go" }, forget, use));
  const stage = h("div", { class: "stage" }, canvas.element);
  const column = h("div", { class: "edit-column" }, reason, absent, inspector.element, drafting.element, order.element, things.element, rehearsal?.element ?? null, upload);
  const element = h("div", { class: "edit" }, toolbar, stage, column, foot);
  let giving = false;
  let ended = false;

  async function give() {
    giving = true;
    update();
    const { building } = desk;
    fill(answer, h("span", { class: "spinner", "aria-hidden": "true" }), h("span", {}, t("edit.giving")));
    try {
      const { accepted, text } = await desk.use();
      if (!accepted) {
        fill(answer, icon("alert"), h("span", { class: "bad-words" }, text ? sentence(text) : t("answer.refused")));
        if (await desk.isOvertaken()) answer.append(button(t("edit.reload"), null, { onclick: reload }));
      } else {
        fill(answer, h("span", { class: "spinner", "aria-hidden": "true" }), h("span", {}, t("edit.taking")));
        desk.inUse = building;
        desk.forget();
        const back = await desk.returned(building);
        if (!ended) fill(answer, icon(back ? "check" : "wait"), h("span", {}, t(back ? "edit.taken" : "edit.not_back")));
        await desk.load();
        dispatchEvent(new Event("sereno:building"));
      }
    } catch (error) {
      fill(answer, icon("alert"), h("span", { class: "bad-words" }, trouble(error)));
    }
    giving = false;
    if (!ended) update();
  }

  /** Takes the drone's building as it is now; a draft stays on the desk. */
  async function reload() {
    if (!desk.draft && desk.unsaved && !confirm(t("edit.forget_sure"))) return;
    await desk.load();
    fill(answer);
  }

  function update() {
    const { draft, may } = desk;
    setData(element, "draft", Boolean(draft));
    show(toolbar, may);
    show(foot, may);
    show(reason, !may);
    setText(reason.lastElementChild, t(desk.installer ? "edit.unknown" : "edit.read_only"));
    show(drafting.element, Boolean(draft) && may);
    if (upload) show(upload, !draft && may);
    if (rehearsal) show(rehearsal.element, may);
    show(order.element, !draft || desk.isMade);
    show(absent, desk.error !== null);
    if (desk.error) setText(absent.lastElementChild, trouble(desk.error));
    undo.disabled = !desk.history.canUndo;
    redo.disabled = !desk.history.canRedo;
    const changed = draft ? [] : desk.changes;
    const words = changed.slice(0, NAMED).map(changeWords);
    if (changed.length > NAMED) words.push(t("change.more", { count: changed.length - NAMED }));
    fill(summary, draft ? h("p", { class: "quiet small" }, t(desk.isMade ? "draft.ready" : "draft.not_ready"))
      : words.length === 0 ? h("p", { class: "quiet small" }, t("change.none"))
        : [h("strong", {}, t("change.title")), h("ul", {}, words.map((one) => h("li", {}, one)))]);
    use.disabled = giving || (draft ? !desk.isMade : words.length === 0);
    setText(use.lastElementChild, t(draft ? "edit.install" : "edit.use"));
    show(forget, !draft && words.length > 0 && !giving);
    for (const panel of [order, things, drafting, rehearsal, inspector]) panel?.update();
    canvas.redraw();
  }
  function tooled() {
    for (const one of tools) one.setAttribute("aria-pressed", String(one.dataset.tool === desk.tool));
    show(shapes, ["no_fly", "privacy", "rooms"].includes(desk.tool));
    for (const one of shapes.children) one.setAttribute("aria-pressed", String(one.dataset.shape === desk.shape));
    canvas.begin();
    drafting.update();
  }
  const listeners = [
    ["change", update], ["select", () => {
      inspector.select();
      things.update();
      canvas.redraw();
    }], ["tool", tooled], ["load", () => canvas.load()], ["draft", () => {
      canvas.load();
      rehearsal?.clear();
      column.scrollTop = 0;
    }], ["scale", () => canvas.fit()],
  ];
  for (const [name, handler] of listeners) desk.addEventListener(name, handler);
  const keys = (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.target.matches("input, textarea")) return;
    const key = event.key.toLowerCase();
    if (key !== "z" && key !== "y") return;
    event.preventDefault();
    if (key === "y" || event.shiftKey) desk.redo();
    else desk.undo();
  };
  const leaving = (event) => {
    if (desk.unsaved) event.preventDefault();
  };
  addEventListener("keydown", keys);
  addEventListener("beforeunload", leaving);
  tooled();
  inspector.select();
  update();
  const name = drones.length > 1
    ? h("select", { class: "select small-select", "aria-label": t("link.drone"), onchange: (event) => {
        location.hash = `#/plan/${encodeURIComponent(event.target.value)}`;
        // Called off: the address is as it was, and so is the choice.
        queueMicrotask(() => { event.target.value = drone; });
      } }, drones.map((one) => h("option", { value: one, selected: one === drone }, one)))
    : h("strong", {}, drone);

  return {
    element,
    bar: h("div", { class: "link" }, name),
    title: t("nav.plan"),
    focus: false,
    /** Whether somebody may go: asks when something would be lost. */
    leave() {
      if (desk.unsaved && !confirm(t("edit.leave"))) return false;
      standing = null;
      return true;
    },
    end() {
      ended = true;
      for (const [event, handler] of listeners) desk.removeEventListener(event, handler);
      removeEventListener("keydown", keys);
      removeEventListener("beforeunload", leaving);
      rehearsal?.end();
      canvas.end();
    },
  };
}
