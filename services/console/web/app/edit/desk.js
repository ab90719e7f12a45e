// What lies on the installer's desk for one drone: the building in use as it is being edited, or a picture that becomes a plan. Panels
// read it and tell it; it knows no panel. It stays while other words or another light are chosen.

import * as api from "../net/api.js";
import { aboutOf } from "../pure/about.js";
import { added, buildingOf, changes, equal, itemsOf, removed, replaced } from "../pure/building.js";
import { grown, making, stateOf } from "../pure/drafting.js";
import { History } from "../pure/history.js";

/** How long a drone may take to come back with its new building, and how often it is asked. */
const RETURN_MS = 90_000;
const ASK_MS = 2000;

export class Desk extends EventTarget {
  constructor(drone, account) {
    super();
    this.drone = drone;
    this.account = account;
    this.installer = ["installer", "administrator"].includes(account.role);
    /** Whether the drone says what is in its building: what is not known must not be written over. */
    this.known = true;
    this.about = null;
    /** Which building it is that is being edited. */
    this.revision = "";
    this.error = null;
    /** The draft on the desk: {id, width, height}; null for the building in use. */
    this.draft = null;
    /** What the console made of the draft, and of which state. */
    this.made = null;
    this.madeOf = null;
    this.history = new History({ building: buildingOf(null), reading: null });
    this.selected = null;
    this.tool = "select";
    this.shape = "rectangle";
    this.load();
  }
  get state() {
    return this.history.now;
  }
  get building() {
    return this.state.building;
  }
  get reading() {
    return this.state.reading;
  }
  get may() {
    return this.installer && this.known;
  }
  get changes() {
    return changes(this.history.base.building, this.building);
  }
  /** Whether something would be lost by leaving. */
  get unsaved() {
    return this.may && (this.draft ? this.history.canUndo : !equal(this.history.base.building, this.building));
  }
  /** Whether the plan of the draft is that of what is on the desk. */
  get isMade() {
    return this.made !== null && this.madeOf === this.state;
  }
  tell(name) {
    this.dispatchEvent(new Event(name));
  }
  async load() {
    try {
      const value = await api.about(this.drone);
      this.about = aboutOf(value);
      this.known = value.building !== undefined && value.building !== null;
      this.revision = String(value.revision ?? "");
      // A drone that does not say what is in its building says at least where rooms are.
      const building = buildingOf(value.building);
      if (!this.draft) this.history.begin({ building, reading: null });
      this.inUse = building;
      this.error = null;
    } catch (error) {
      this.error = error;
    }
    this.tell("load");
    this.tell("change");
  }
  push(state, tag = null) {
    if (!this.may) return;
    this.history.push(state, tag);
    this.tell("change");
  }
  edit(building, tag = null) {
    this.push({ ...this.state, building }, tag);
  }
  read(change, tag = null) {
    this.push({ ...this.state, reading: { ...this.reading, ...change } }, tag);
  }
  add(kind, item) {
    this.edit(added(this.building, kind, item));
    this.select({ kind, index: itemsOf(this.building, kind).length - 1 });
  }
  item(selected = this.selected) {
    if (!selected) return null;
    return selected.kind === "pad" ? this.building.pad : itemsOf(this.building, selected.kind)[selected.index] ?? null;
  }
  replace(selected, item, tag = null) {
    if (selected.kind === "pad") this.edit({ ...this.building, pad: item }, tag);
    else this.edit(replaced(this.building, selected.kind, selected.index, item), tag);
  }
  remove(selected) {
    this.selected = null;
    if (selected.kind === "pad") this.edit({ ...this.building, pad: null });
    else this.edit(removed(this.building, selected.kind, selected.index));
    this.tell("select");
  }
  select(selected) {
    this.selected = selected;
    this.history.settle();
    this.tell("select");
  }
  setTool(tool, shape = this.shape) {
    Object.assign(this, { tool, shape });
    if (tool !== "select") this.selected = null;
    this.tell("tool");
    this.tell("select");
  }
  undo() {
    this.history.undo();
    this.afterStep();
  }
  redo() {
    this.history.redo();
    this.afterStep();
  }
  afterStep() {
    if (this.selected && !this.item()) this.selected = null;
    this.tell("change");
    this.tell("select");
  }
  /** All that was not saved goes. */
  forget() {
    this.history.begin({ building: this.inUse ?? buildingOf(null), reading: null });
    Object.assign(this, { draft: null, made: null, madeOf: null, selected: null, tool: "select" });
    this.tell("draft");
    this.tell("change");
  }
  measure(ratio) {
    this.push(grown(this.state, ratio));
    this.tell("scale");
  }
  // Drafts.
  async open(id) {
    const kept = await api.draft(this.drone, id);
    this.draft = kept.draft;
    this.history.begin(stateOf(kept, buildingOf(null)));
    this.made = kept.plan;
    this.madeOf = kept.plan ? this.state : null;
    Object.assign(this, { selected: null, tool: "select" });
    this.tell("draft");
    this.tell("change");
  }
  async upload(file) {
    const { id } = await api.addDraft(this.drone, file);
    await this.open(id);
  }
  async make() {
    const { state } = this;
    this.made = await api.makePlan(this.drone, this.draft.id, making(state));
    this.madeOf = state;
    this.tell("made");
    this.tell("change");
  }
  /** Gives what is on the desk to the drone: its answer {accepted, text}. */
  async use() {
    if (this.draft) return api.installDraft(this.drone, this.draft.id, this.revision);
    return api.editBuilding(this.drone, this.building, this.revision);
  }
  /** Whether the drone has another building by now than the one that the editing began with. */
  async isOvertaken() {
    const value = await api.about(this.drone).catch(() => null);
    return value !== null && String(value.revision ?? "") !== this.revision;
  }
  /** Waits until the drone is back with what it was given; false when it was not seen so. */
  async returned(building) {
    const until = performance.now() + RETURN_MS;
    while (performance.now() < until) {
      await new Promise((resolve) => { setTimeout(resolve, ASK_MS); });
      const value = await api.about(this.drone).catch(() => null);
      if (value && value.building && same(value.building, building)) return true;
    }
    return false;
  }
}

/** Numbers come back from the drone as 32 bits: to the millimetre they are the same. */
function same(a, b) {
  const plain = (value) => JSON.stringify(buildingOf(value), (_, one) => (typeof one === "number" ? Math.round(one * 1000) / 1000 : one));
  return plain(a) === plain(b);
}
