// The alarm: a banner that stays and a sound until somebody acknowledges.

import { h, button, fill, icon, setData, show } from "../view/dom.js";
import { t } from "../words/text.js";

let audio = null;

/** Browsers allow sound only after a click or a key; the first one anywhere wakes it. */
export function wakeSound() {
  try {
    audio ??= new AudioContext();
    if (audio.state === "suspended") audio.resume().catch(() => {});
  } catch {
    audio = null;
  }
}

function soundReady() {
  return audio?.state === "running";
}

/** Two calls of two notes, as a watchman's: audible, not shrill. */
function call() {
  if (!soundReady()) return;
  const start = audio.currentTime + 0.02;
  [[0, 660], [0.22, 880], [0.7, 660], [0.92, 880]].forEach(([delay, pitch]) => {
    const oscillator = audio.createOscillator();
    const gain = audio.createGain();
    oscillator.type = "triangle";
    oscillator.frequency.value = pitch;
    gain.gain.setValueAtTime(0, start + delay);
    gain.gain.linearRampToValueAtTime(0.5, start + delay + 0.02);
    gain.gain.exponentialRampToValueAtTime(0.001, start + delay + 0.36);
    oscillator.connect(gain).connect(audio.destination);
    oscillator.start(start + delay);
    oscillator.stop(start + delay + 0.4);
  });
}

export class AlarmPanel {
  /** `elsewhere`: shown in another view, with the way back. */
  constructor(session, elsewhere = false) {
    this.session = session;
    this.words = h("div", { class: "alarm-words" });
    const back = elsewhere ? h("a", { class: "button", href: `#/watch/${encodeURIComponent(session.drone)}` }, icon("eye"), h("span", {}, t("alarm.back"))) : null;
    this.wake = button(t("alarm.wake"), "bell", { hidden: true, onclick: wakeSound });
    this.acknowledge = button(t("alarm.acknowledge"), "bell-off", { class: "alarm-ack", onclick: () => {
      wakeSound();
      session.alarms.acknowledge();
      this.update();
    } });
    this.element = h("div", { class: "alarm-banner", role: "alert", hidden: true }, icon("alert"), this.words, back, this.wake, this.acknowledge);
    this.shown = "";
    this.next = 0;
  }
  update(now = performance.now()) {
    const { active, sounding } = this.session.alarms;
    show(this.element, active.length > 0);
    const shown = active.map((alarm) => alarm.id).join();
    if (shown !== this.shown) {
      this.shown = shown;
      fill(this.words, active.map((alarm) => h("p", {}, h("strong", {}, title(alarm)), " ", h("span", {}, detail(alarm)))));
    }
    setData(this.element, "sounding", sounding);
    show(this.acknowledge, sounding);
    show(this.wake, sounding && !soundReady());
    if (sounding && now >= this.next) {
      this.next = now + 2400;
      call();
      if (navigator.vibrate && navigator.userActivation?.hasBeenActive) navigator.vibrate([200, 120, 200]);
    }
    if (!sounding) this.next = 0;
  }
}

function title(alarm) {
  if (alarm.kind === "failsafe") return `${t(`cause.${alarm.cause}`)}.`;
  return t(alarm.kind === "lost" ? "alarm.lost" : "alarm.elsewhere");
}

function detail(alarm) {
  if (alarm.kind === "failsafe") return t(`does.${alarm.action}`);
  return t(alarm.kind === "lost" ? "alarm.lost_words" : "alarm.elsewhere_words");
}
