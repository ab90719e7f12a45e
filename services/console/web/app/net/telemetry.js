// `/ws/telemetry`: the newest of every topic, answers to orders, and whether anything comes at all.

import { socketUrl } from "./api.js";
import { Orders } from "./orders.js";
import { Socket } from "./socket.js";
import { News } from "../pure/age.js";
import { grid, particles, splitBinary } from "../pure/binary.js";
import { parse } from "../pure/bits.js";

const BINARY = { "navigation/grid": grid, "localization/particles": particles };

export class Telemetry {
  /** `heard(topic, data)` is called for each message, `event(line)` for lines of the event log, `link()` when the link changes. */
  constructor(drone, handlers) {
    this.handlers = handlers;
    this.news = new News();
    this.latest = {};
    this.wanted = new Set();
    this.alive = null;
    this.refused = 0;
    this.socket = new Socket(socketUrl("telemetry", drone), {
      open: () => {
        this.subscribe();
        handlers.link();
      },
      text: (text) => this.text(text),
      binary: (buffer) => this.binary(buffer),
      closed: () => {
        this.orders.closed();
        handlers.link();
      },
    });
    this.orders = new Orders((value) => this.socket.send(value));
  }
  get connected() {
    return this.socket.open;
  }
  /** Topics that are to come from now on. */
  want(topics) {
    const wanted = new Set(topics);
    if (wanted.size === this.wanted.size && [...wanted].every((topic) => this.wanted.has(topic))) return;
    this.wanted = wanted;
    this.subscribe();
  }
  subscribe() {
    this.socket.send({ subscribe: [...this.wanted] });
  }
  text(text) {
    let message;
    try {
      message = parse(text);
    } catch {
      this.refused += 1;
      return;
    }
    if (message === null || typeof message !== "object") return;
    if (typeof message.topic === "string") this.take(message.topic, message.data);
    else if (typeof message.alive === "boolean") {
      this.alive = message.alive;
      this.handlers.link();
    } else if (message.answer) this.orders.answered(message.answer);
    else if (message.event) this.handlers.event(message.event);
    else if (message.recording) this.handlers.recording?.(message.recording);
    else if (typeof message.error === "string") this.handlers.event({ kind: "link", text: message.error });
  }
  binary(buffer) {
    const split = splitBinary(buffer);
    const read = split && BINARY[split.topic];
    const data = read ? read(split.bytes) : null;
    if (data) this.take(split.topic, data);
    else this.refused += 1;
  }
  take(topic, data) {
    if (data === null || typeof data !== "object") return;
    this.latest[topic] = data;
    this.news.heard(topic, performance.now());
    this.alive = true;
    this.handlers.heard(topic, data);
  }
  end() {
    this.socket.end();
    this.orders.closed();
  }
}
