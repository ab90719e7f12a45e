// Recording, below the picture: whether it is being recorded, since when, and the button for who may.

import * as api from "../net/api.js";
import { clock } from "../pure/age.js";
import { recordingOf } from "../pure/recording.js";
import { h, icon, setData, setIcon, setText, show } from "../view/dom.js";
import { trouble } from "../view/form.js";
import { sentence } from "../words/sentences.js";
import { t } from "../words/text.js";

export class RecordBar {
  /** `keeps` is what the console says of itself: {keeps, reason}. */
  constructor(session, keeps) {
    this.session = session;
    this.keeps = keeps;
    this.error = "";
    this.symbol = icon("record");
    this.words = h("span", { class: "label" });
    this.button = h("button", { type: "button", class: "button record-button", onclick: () => this.turn() }, this.symbol, this.words);
    this.state = h("span", { class: "record-state" });
    // Each second would be read out: only the change of the state is told.
    this.told = h("span", { class: "unseen", role: "status" });
    this.time = h("span", { class: "record-time", "aria-hidden": "true" });
    this.element = h("div", { class: "record-bar" }, this.button, this.state, this.time, this.told);
    show(this.button, session.mayOrder && keeps.keeps);
    this.update(performance.now());
  }
  get now() {
    return recordingOf(this.session.recording?.told);
  }
  async turn() {
    const { on } = this.now;
    this.button.disabled = true;
    this.error = "";
    try {
      await (on ? api.stopRecording : api.startRecording)(this.session.drone);
    } catch (error) {
      this.error = trouble(error);
    } finally {
      this.button.disabled = false;
      this.update(performance.now());
    }
  }
  update(now) {
    const { on, lasts_ms, account, trouble: ended } = this.now;
    setData(this.element, "on", on);
    setIcon(this.symbol, on ? "record-stop" : "record");
    setText(this.words, t(on ? "record.stop" : "record.start"));
    let words = "";
    if (!this.keeps.keeps) words = t("record.keeps_none");
    else if (on) words = t("record.on", { who: account });
    else words = this.error || (ended ? sentence(ended) : "");
    setText(this.state, words);
    setText(this.told, on ? words : "");
    show(this.time, on);
    if (on) setText(this.time, clock((lasts_ms + now - this.session.recording.at) / 1000));
    show(this.element, words !== "" || !this.button.hidden);
  }
}
