// The console's HTTP routes. Every failure is an `ApiError` with a sentence.

export class ApiError extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

async function request(method, path, body) {
  let response;
  try {
    response = await fetch(path, {
      method,
      credentials: "same-origin",
      headers: body === undefined ? {} : { "content-type": "application/json" },
      body: body === undefined ? undefined : JSON.stringify(body),
    });
  } catch {
    throw new ApiError(0, "");
  }
  const text = await response.text();
  let value = null;
  try {
    value = text ? JSON.parse(text) : null;
  } catch {
    if (response.ok) throw new ApiError(response.status, "");
  }
  if (!response.ok) throw new ApiError(response.status, value?.error ?? "");
  return value;
}

const path = encodeURIComponent;

export const session = () => request("GET", "/api/session");
export const claim = (form) => request("POST", "/api/claim", form);
export const login = (email, password) => request("POST", "/api/login", { email, password });
export const logout = () => request("POST", "/api/logout", {});
export const keepLanguage = (language) => request("PATCH", "/api/session", { language });
export const changePassword = (old, next) => request("POST", "/api/password", { old, new: next });
export const accounts = () => request("GET", "/api/accounts");
export const createAccount = (form) => request("POST", "/api/accounts", form);
export const changeAccount = (id, form) => request("PATCH", `/api/accounts/${path(id)}`, form);
export const log = (before, limit) => request("GET", `/api/log?limit=${limit}${before ? `&before=${path(before)}` : ""}`);
export const drones = () => request("GET", "/api/drones");
export const about = (drone) => request("GET", `/api/drones/${path(drone)}/about`);
export const planUrl = (drone) => `/api/drones/${path(drone)}/plan.png`;
export const reports = (drone) => request("GET", `/api/reports${drone ? `?drone=${path(drone)}` : ""}`);
export const report = (id) => request("GET", `/api/reports/${path(id)}`);

/** Address of a WebSocket of the console. */
export function socketUrl(name, drone) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return `${scheme}://${location.host}/ws/${name}?drone=${path(drone)}`;
}

export const markIncident = (drone, text) => request("POST", `/api/drones/${path(drone)}/incidents`, { text });
export const incidents = (drone) => request("GET", `/api/drones/${path(drone)}/incidents`);
