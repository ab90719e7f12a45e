// The console's HTTP routes. Every failure is an `ApiError` with a sentence.

export class ApiError extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

function request(method, path, body) {
  return send(method, path, body === undefined ? null : "application/json", body === undefined ? undefined : JSON.stringify(body));
}

async function send(method, path, type, body) {
  let response;
  try {
    response = await fetch(path, {
      method,
      credentials: "same-origin",
      headers: type === null ? {} : { "content-type": type },
      body,
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
export const devices = () => request("GET", "/api/trust");
export const devicesCodeUrl = "/api/trust/qr.svg";
export const drones = () => request("GET", "/api/drones");
export const about = (drone) => request("GET", `/api/drones/${path(drone)}/about`);
/** `hash` tells one plan from the next, so that no old picture of it is shown. */
export const planUrl = (drone, hash) => `/api/drones/${path(drone)}/plan.png?hash=${path(hash)}`;
export const stillUrl = (drone) => `/api/drones/${path(drone)}/still.jpg`;
export const reports = (drone) => request("GET", `/api/reports${drone ? `?drone=${path(drone)}` : ""}`);
export const report = (id) => request("GET", `/api/reports/${path(id)}`);

export const recordings = (drone) => request("GET", `/api/drones/${path(drone)}/recordings`);
export const startRecording = (drone) => request("POST", `/api/drones/${path(drone)}/recordings`, {});
export const stopRecording = (drone) => request("POST", `/api/drones/${path(drone)}/recordings/stop`, {});
export const eraseRecording = (drone, id) => request("POST", `/api/drones/${path(drone)}/recordings/${path(id)}/erase`, {});
export const filmUrl = (drone, id) => `/api/drones/${path(drone)}/recordings/${path(id)}/film.mp4`;

// The building, and plans that are made of pictures.
/** `made_from` is the `revision` of what the drone said of itself when the editing began. */
export const editBuilding = (drone, building, made_from) => request("POST", `/api/drones/${path(drone)}/building`, { building, made_from });
export const draft = (drone, id) => request("GET", `/api/drones/${path(drone)}/drafts/${path(id)}`);
export const makePlan = (drone, id, making) => request("POST", `/api/drones/${path(drone)}/drafts/${path(id)}`, making);
export const installDraft = (drone, id, made_from) => request("POST", `/api/drones/${path(drone)}/drafts/${path(id)}/install`, { made_from });
export const addDraft = (drone, file) => send("POST", `/api/drones/${path(drone)}/drafts`, file.type || "application/octet-stream", file);
export const draftPictureUrl = (drone, id) => `/api/drones/${path(drone)}/drafts/${path(id)}/picture`;
export const draftPlanUrl = (drone, id) => `/api/drones/${path(drone)}/drafts/${path(id)}/plan.png`;
export const rehearsals = (drone) => request("GET", `/api/drones/${path(drone)}/rehearsals`);
export const rehearse = (drone, wish) => request("POST", `/api/drones/${path(drone)}/rehearsals`, wish);
export const rehearsal = (drone, id) => request("GET", `/api/drones/${path(drone)}/rehearsals/${path(id)}`);

/** Address of a WebSocket of the console. */
export function socketUrl(name, drone) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  return `${scheme}://${location.host}/ws/${name}?drone=${path(drone)}`;
}

export const markIncident = (drone, text, keep = true) => request("POST", `/api/drones/${path(drone)}/incidents`, { text, keep });
export const incidents = (drone) => request("GET", `/api/drones/${path(drone)}/incidents`);
