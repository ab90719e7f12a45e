// The picture: WebRTC in the thesis's roles. The page calls, the drone offers, the page answers; the age is always shown.

import { socketUrl } from "../net/api.js";
import { Socket } from "../net/socket.js";
import { Decoder, hasH264, takesH264 } from "../pure/decoding.js";
import { h, icon, iconButton, setData, setText, show } from "../view/dom.js";
import { sentence } from "../words/sentences.js";
import { number, t } from "../words/text.js";
import { ageWords } from "./situation.js";
import { Stills } from "./still.js";

const SIZES = [{ width: 640, height: 480, fps: 30 }, { width: 1280, height: 720, fps: 15 }, { width: 1920, height: 1080, fps: 15 }];
/** Without an offer for so long there is no video from this drone; it is asked for again after a while. */
const PATIENCE_MS = 5000;
const AGAIN_MS = 20_000;
/** The buffer against jitter in watch mode; none is asked for in pilot mode. */
const WATCH_BUFFER_MS = 100;
/** A picture older than this stands still; a still may be older. */
const FROZEN_MS = 1000;
const STILL_OLD_MS = 4000;
/** The decoder is looked at so often. */
const LOOK_MS = 1000;
const KEY = "sereno.video";

function kept() {
  try {
    const { size, mode } = JSON.parse(localStorage.getItem(KEY));
    return { size: size in SIZES ? size : 1, mode: mode === "pilot" ? "pilot" : "watch" };
  } catch {
    return { size: 1, mode: "watch" };
  }
}

export class VideoPanel {
  constructor(session) {
    this.session = session;
    Object.assign(this, kept());
    this.video = h("video", { autoplay: true, playsinline: true, muted: true, "aria-label": t("video.name") });
    this.video.muted = true;
    this.image = h("img", { alt: t("video.still.name"), hidden: true });
    this.stills = new Stills(session.drone, this.image, (why) => this.stillTold(why));
    this.words = h("p", {});
    this.cover = h("div", { class: "video-cover", role: "status" }, icon("video-off"), this.words);
    this.age = h("span", { class: "chip video-age", hidden: true });
    this.path = h("span", { class: "video-path" });
    this.foot = h("div", { class: "video-foot" }, this.path);
    this.choice = h("select", { class: "select small-select", "aria-label": t("video.size"), onchange: (event) => {
      this.size = Number(event.target.value);
      this.call();
    } }, SIZES.map(({ height, fps }, k) => h("option", { value: k, selected: k === this.size }, `${height}p · ${fps}`)));
    this.modes = ["watch", "pilot"].map((mode) => h("button", { type: "button", title: t(`video.${mode}_hint`), onclick: () => {
      this.mode = mode;
      this.call();
    } }, t(`video.${mode}`)));
    const full = iconButton(t("video.full"), "full", { onclick: () => this.video.requestFullscreen?.().catch(() => {}) });
    this.element = h("section", { class: "panel video-panel", "aria-label": t("video.name") },
      h("div", { class: "video-stage" }, this.video, this.image, this.cover, this.age),
      h("div", { class: "video-bar" }, h("div", { class: "segments", role: "group", "aria-label": t("video.mode") }, this.modes), this.choice, full),
      this.foot);
    this.frameAt = null;
    this.delay = 0;
    this.sentAge = 0;
    this.state = "calling";
    this.socket = new Socket(socketUrl("signal", session.drone), {
      open: () => this.call(),
      text: (text) => this.heard(text),
      closed: () => {
        if (this.state !== "still") this.drop("calling");
      },
    });
    this.frames();
    this.reflect();
  }
  /** Calls, or calls again with another resolution or mode. */
  call() {
    try {
      localStorage.setItem(KEY, JSON.stringify({ size: this.size, mode: this.mode }));
    } catch {
      // Chosen anew at the next visit.
    }
    this.reflect();
    clearTimeout(this.timer);
    this.tuneBuffer();
    if (!window.RTCPeerConnection) return this.showStills("unable");
    if (!hasH264(window.RTCRtpReceiver?.getCapabilities?.("video"))) return this.showStills("codec");
    this.stills.stop();
    if (this.state === "still") this.set("calling");
    if (!this.socket.send({ call: { ...SIZES[this.size], mode: this.mode } })) return;
    if (this.peer) return;
    if (this.state !== "none") this.set("calling");
    this.timer = setTimeout(() => {
      this.set("none");
      this.timer = setTimeout(() => this.call(), AGAIN_MS);
    }, PATIENCE_MS);
  }
  async heard(text) {
    let message;
    try {
      message = JSON.parse(text);
    } catch {
      return;
    }
    try {
      if (message?.offer) await this.offered(message.offer);
      else if (message?.candidate) await this.candidate(message.candidate);
      else if (message?.status) this.told(message.status);
      else if (message?.hang_up) this.hungUp(message.hang_up.reason ?? "");
      else if (message?.error) this.complaint(message.error.text ?? String(message.error));
    } catch {
      this.drop("error");
    }
  }
  async offered({ sdp, servers }) {
    clearTimeout(this.timer);
    this.close();
    const peer = new RTCPeerConnection({ iceServers: Array.isArray(servers) ? servers : [] });
    this.peer = peer;
    this.early = [];
    this.set("connecting");
    peer.ontrack = ({ track, streams }) => {
      this.video.srcObject = streams[0] ?? new MediaStream([track]);
      this.video.play().catch(() => {});
      this.lookAt(peer);
      this.tuneBuffer();
    };
    peer.onicecandidate = ({ candidate }) => {
      if (candidate && this.peer === peer) this.socket.send({ candidate: candidate.toJSON() });
    };
    peer.onconnectionstatechange = () => {
      if (this.peer !== peer) return;
      if (peer.connectionState === "failed") {
        this.socket.send({ hang_up: { reason: "connection failed" } });
        this.drop("failed");
        this.timer = setTimeout(() => this.call(), 2000);
      }
    };
    await peer.setRemoteDescription({ type: "offer", sdp });
    const answer = await peer.createAnswer();
    if (!takesH264(answer.sdp)) return this.showStills("codec");
    await peer.setLocalDescription(answer);
    if (this.peer !== peer) return;
    this.socket.send({ answer: { sdp: answer.sdp } });
    for (const candidate of this.early.splice(0)) await peer.addIceCandidate(candidate);
  }
  /** Video that comes and is not decoded is no video: stills then. */
  lookAt(peer) {
    const decoder = new Decoder();
    clearInterval(this.looking);
    this.looking = setInterval(async () => {
      if (this.peer !== peer) return;
      for (const entry of (await peer.getStats()).values()) {
        if (entry.type === "inbound-rtp" && decoder.isStuck(entry, performance.now())) return this.showStills("stuck");
      }
    }, LOOK_MS);
  }
  /** No video in this browser: one picture a second, and why. */
  showStills(why) {
    if (this.peer) this.socket.send({ hang_up: { reason: `no video in this browser: ${why}` } });
    this.drop("still");
    this.why = why;
    setText(this.path, t(`video.still.${why}`));
    this.stills.start();
  }
  stillTold(why) {
    this.reason = why;
    this.reflect();
  }
  async candidate(candidate) {
    if (!this.peer) return;
    if (this.peer.remoteDescription) await this.peer.addIceCandidate(candidate);
    else if (this.early.length < 64) this.early.push(candidate);
  }
  /** Ended by the drone, for a reason that may have gone: it is called again after a while. */
  hungUp(reason) {
    if (this.state === "still") return;
    this.drop("hung_up", reason);
    this.timer = setTimeout(() => this.call(), AGAIN_MS);
  }
  /** Something was refused; the session goes on. */
  complaint(text) {
    if (this.state === "live") setText(this.path, sentence(text));
    else this.set("error", text);
  }
  tuneBuffer() {
    for (const receiver of this.peer?.getReceivers() ?? []) {
      if ("jitterBufferTarget" in receiver) receiver.jitterBufferTarget = this.mode === "watch" ? WATCH_BUFFER_MS : null;
    }
  }
  told(status) {
    this.sentAge = Number.isFinite(status.age_ms) ? status.age_ms : 0;
    const way = ["udp", "tcp", "turn"].includes(status.path) ? t(`video.path.${status.path}`) : "";
    const size = Number.isFinite(status.height) ? `${status.height}p` : "";
    const others = status.chosen_by && status.chosen_by !== this.session.account.email ? t("video.chosen_by", { who: status.chosen_by }) : "";
    setText(this.path, [size, Number.isFinite(status.fps) ? `${number(status.fps)} fps` : "", way, others].filter(Boolean).join(" · "));
  }
  /** Counts the frames as they are shown, with the time at which each was caught where the drone tells it. */
  frames() {
    const next = (now, frame) => {
      this.frameAt = performance.now();
      // From the camera's clock where it comes along; else from its arrival, and what the drone says of its age when it left.
      const since = (from) => Math.max(0, frame.expectedDisplayTime - from);
      if (frame.captureTime !== undefined) this.delay = since(frame.captureTime);
      else this.delay = (frame.receiveTime === undefined ? 0 : since(frame.receiveTime)) + this.sentAge;
      if (this.state !== "live") this.set("live");
      if (!this.ended) this.video.requestVideoFrameCallback(next);
    };
    this.video.requestVideoFrameCallback?.(next);
  }
  set(state, text = "") {
    this.state = state;
    this.reason = text;
    this.reflect();
  }
  reflect() {
    setData(this.element, "state", this.state);
    const still = this.state === "still" && this.stills.takenAt !== null;
    show(this.video, this.state !== "still");
    show(this.image, still);
    show(this.cover, this.state !== "live" && !still);
    setText(this.words, this.reason ? `${t(`video.state.${this.state}`)} ${sentence(this.reason)}` : t(`video.state.${this.state}`));
    this.modes.forEach((element, k) => element.setAttribute("aria-pressed", String(this.mode === ["watch", "pilot"][k])));
  }
  update(now) {
    const still = this.state === "still" && this.stills.takenAt !== null;
    const live = this.state === "live" && this.frameAt !== null;
    show(this.age, live || still);
    if (!live && !still) return;
    const age = still ? now - this.stills.takenAt : now - this.frameAt + this.delay;
    const frozen = still ? age > STILL_OLD_MS : now - this.frameAt > FROZEN_MS;
    setData(this.element, "frozen", frozen);
    setText(this.age, frozen ? t("video.frozen", { age: ageWords(age) }) : t("video.age", { age: ageWords(age) }));
  }
  close() {
    const { peer } = this;
    this.peer = null;
    clearInterval(this.looking);
    peer?.close();
    this.video.srcObject = null;
    this.frameAt = null;
    setText(this.path, "");
  }
  drop(state, text = "") {
    clearTimeout(this.timer);
    this.close();
    this.set(state, text);
  }
  end() {
    this.ended = true;
    if (this.peer) this.socket.send({ hang_up: { reason: "closed" } });
    clearTimeout(this.timer);
    this.stills.stop();
    this.close();
    this.socket.end();
  }
}
