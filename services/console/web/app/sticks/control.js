// Manual control: sources of input, the socket of the sticks, taking and releasing. The rules are in `pure/`.

import { socketUrl } from "../net/api.js";
import { Orders } from "../net/orders.js";
import { Socket } from "../net/socket.js";
import { word, STICKS } from "../pure/codes.js";
import { Pace, frame, join } from "../pure/frame.js";
import { Liveness } from "../pure/liveness.js";
import { Keyboard } from "./keyboard.js";
import { Pads } from "./pads.js";
import { Touch } from "./touch.js";

/** How often gamepads are looked at, ms: browsers refresh them every 4 to 16. */
const LOOK_MS = 4;

/** Events: "change" whenever something that is shown may have changed. */
export class Control extends EventTarget {
  constructor(drone, pilot, account) {
    super();
    this.drone = drone;
    this.pilot = pilot;
    this.account = account;
    this.liveness = new Liveness();
    this.pace = new Pace();
    this.pads = new Pads(this.liveness);
    this.keyboard = new Keyboard(this.liveness, () => this.work());
    this.touch = new Touch(this.liveness, () => this.work());
    this.switches = { height_hold: true, heading_hold: true };
    this.socket = null;
    this.number = null;
    this.open = false;
    this.asked = null;
    this.answer = null;
    this.wish = join([]);
    this.held = false;
    this.guards = [
      [document, "visibilitychange", () => this.reasons()],
      [window, "blur", () => this.reasons()],
      [window, "focus", () => this.reasons()],
      [window, "pagehide", () => this.release()],
      [window, "keydown", (event) => {
        if (event.key === "Escape" && this.hasLease) this.release();
      }],
    ];
  }
  /** Opens the socket: beacons begin, nothing is held yet. */
  begin() {
    if (this.open) return;
    this.open = true;
    this.orders = new Orders((value) => this.socket.send(value));
    this.socket = new Socket(socketUrl("sticks", this.drone), {
      text: (text) => this.text(text),
      closed: () => {
        this.number = null;
        this.orders.closed();
        this.changed();
      },
    });
    for (const [target, name, handler] of this.guards) target.addEventListener(name, handler);
    this.reasons();
    this.keyboard.begin();
    this.timer = setInterval(() => this.work(), LOOK_MS);
    this.changed();
  }
  /** Closes it; who holds the sticks lets go first. */
  finish() {
    if (!this.open) return;
    this.release();
    this.open = false;
    clearInterval(this.timer);
    this.keyboard.finish();
    for (const [target, name, handler] of this.guards) target.removeEventListener(name, handler);
    this.orders.closed();
    this.socket.end();
    this.socket = null;
    this.number = null;
    this.changed();
  }
  end() {
    this.finish();
  }
  text(text) {
    let message;
    try {
      message = JSON.parse(text);
    } catch {
      return;
    }
    if (Number.isFinite(message?.beacon_ns)) {
      this.liveness.heardBeacon(message.beacon_ns, performance.now());
      if (Number.isFinite(message.socket) && message.socket !== this.number) {
        this.number = message.socket;
        this.changed();
      }
    } else if (message?.answer) this.orders.answered(message.answer);
    else if (typeof message?.error === "string") {
      this.answer = { outcome: "refused", text: message.error };
      this.changed();
    }
  }
  /** Whether the drone says that this very socket holds the sticks. */
  get hasLease() {
    const pilot = this.pilot();
    return Boolean(pilot?.lease && this.number !== null && pilot.holder_socket === this.number);
  }
  get sticksState() {
    return word(STICKS, this.pilot()?.sticks ?? 0);
  }
  /** Somebody else who holds them, or "". */
  get otherHolder() {
    const pilot = this.pilot();
    return pilot?.lease && !this.hasLease ? pilot.holder || "?" : "";
  }
  async take() {
    this.begin();
    this.asked = "take";
    this.answer = null;
    this.changed();
    this.answer = await this.orders.give("sticks-take");
    this.asked = null;
    this.changed();
    return this.answer;
  }
  release() {
    if (!this.open) return;
    this.touch.letGo();
    this.keyboard.letGo();
    this.work();
    const lease = this.pilot()?.lease;
    if (this.hasLease) this.orders.give("sticks-release", { lease }).then(() => this.changed());
    this.answer = null;
    this.changed();
  }
  setSwitch(name, on) {
    this.switches[name] = on;
    this.work();
    this.changed();
  }
  /** Says what makes input untrustworthy now. */
  reasons() {
    const set = (reason, holds) => (holds ? this.liveness.block(reason) : this.liveness.unblock(reason));
    const hidden = document.visibilityState === "hidden";
    const blurred = !document.hasFocus();
    if (hidden || blurred) {
      this.keyboard.letGo();
      this.touch.letGo();
    }
    set("hidden", hidden);
    set("blurred", blurred && !hidden);
    this.work();
    this.changed();
  }
  /** News of the pilot's state. */
  state() {
    this.changed();
  }
  changed() {
    this.dispatchEvent(new Event("change"));
  }
  /** Looks at every source and sends what is due. */
  work() {
    if (!this.open) return;
    const now = performance.now();
    const pad = this.pads.look(now);
    this.wish = join([pad, this.keyboard.wish, this.touch.wish]);
    const held = this.wish.held && this.liveness.blocks.size === 0;
    const pressed = held && !this.held;
    this.held = held;
    if (!this.hasLease) {
      // Whoever begins to hold the button takes over; the drone stops first and waits for neutral sticks all the same.
      if (pressed && this.asked === null && !this.otherHolder) this.take();
      return;
    }
    if (!this.pace.due(this.liveness.sequence, held, now)) return;
    // What the network has not taken would arrive late and all at once: newest wins, so nothing is added.
    if (this.socket.backlog > 4096) return;
    const message = frame(this.pilot().lease, this.liveness, this.wish, this.switches, now);
    if (message && this.socket.send(message)) this.pace.mark(this.liveness.sequence, held, now);
  }
}
