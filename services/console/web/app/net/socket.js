// A WebSocket that comes back: after 0.5 s, doubling to 8 s, at once when the page is seen or the network returns.

/** Close codes of the console: the session is over, or this drone is no longer for this account. */
const LOGGED_OUT = 4401;
const NOT_ALLOWED = 4403;

export class Socket {
  /** `handlers`: open(), text(string), binary(ArrayBuffer), closed(). */
  constructor(url, handlers) {
    this.url = url;
    this.handlers = handlers;
    this.wait = 500;
    this.ended = false;
    this.timer = null;
    this.socket = null;
    this.again = () => {
      if (!this.open && document.visibilityState === "visible") this.connect();
    };
    document.addEventListener("visibilitychange", this.again);
    addEventListener("online", this.again);
    this.connect();
  }
  get open() {
    return this.socket?.readyState === WebSocket.OPEN;
  }
  connect() {
    if (this.ended || (this.socket && this.socket.readyState <= WebSocket.OPEN)) return;
    clearTimeout(this.timer);
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => {
      this.wait = 500;
      this.handlers.open?.();
    };
    socket.onmessage = (event) => {
      if (this.ended) return;
      if (typeof event.data === "string") this.handlers.text?.(event.data);
      else this.handlers.binary?.(event.data);
    };
    socket.onclose = ({ code }) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (this.ended) return;
      this.handlers.closed?.();
      if (code === LOGGED_OUT || code === NOT_ALLOWED) {
        this.ended = true;
        dispatchEvent(new Event("sereno:session"));
        return;
      }
      this.timer = setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(this.wait * 2, 8000);
    };
  }
  /** False when it could not be given to the network. */
  send(value) {
    if (!this.open) return false;
    this.socket.send(JSON.stringify(value));
    return true;
  }
  /** Bytes given but not yet taken by the network. */
  get backlog() {
    return this.socket?.bufferedAmount ?? 0;
  }
  end() {
    this.ended = true;
    clearTimeout(this.timer);
    document.removeEventListener("visibilitychange", this.again);
    removeEventListener("online", this.again);
    this.socket?.close();
    this.socket = null;
  }
}
