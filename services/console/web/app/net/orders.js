// Orders on a socket and their answers, matched by number.

/** An order is answered at once as a rule, after ten seconds at most, when a route is worked out. */
const PATIENCE_MS = 12_000;

export class Orders {
  constructor(send) {
    this.send = send;
    this.next = 1;
    this.open = new Map();
  }
  /** Resolves to {outcome: "accepted" | "refused" | "unsent" | "unanswered", text}. Never rejects. */
  give(verb, more = {}) {
    const id = this.next;
    this.next += 1;
    if (!this.send({ order: { id, verb, ...more } })) return Promise.resolve({ outcome: "unsent", text: "" });
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.settle(id, { outcome: "unanswered", text: "" }), PATIENCE_MS);
      this.open.set(id, { resolve, timer });
    });
  }
  answered({ id, accepted, text }) {
    this.settle(id, { outcome: accepted ? "accepted" : "refused", text: text ?? "" });
  }
  /** The socket has closed: what was given may or may not have arrived. */
  closed() {
    for (const id of [...this.open.keys()]) this.settle(id, { outcome: "unanswered", text: "" });
  }
  settle(id, result) {
    const order = this.open.get(id);
    if (!order) return;
    this.open.delete(id);
    clearTimeout(order.timer);
    order.resolve(result);
  }
}
