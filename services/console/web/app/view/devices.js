// A QR code that leads a phone to /trust, for administrators.

import * as api from "../net/api.js";
import { h, icon, fill } from "./dom.js";
import { trouble } from "./form.js";
import { openDialog } from "./dialog.js";
import { groups, isOwnMachine } from "../pure/devices.js";
import { t } from "../words/text.js";

function note(words, tone = "") {
  return h("p", { class: `note ${tone}`.trim() }, icon("alert"), h("span", {}, words));
}

function offered(fingerprint) {
  const address = `${location.origin}/trust`;
  return [
    isOwnMachine(location.hostname) ? note(t("devices.local")) : null,
    h("img", { class: "trust-code", src: api.devicesCodeUrl, alt: t("devices.alt", { address }), width: 272, height: 272 }),
    h("p", {}, h("a", { href: "/trust", target: "_blank", rel: "noopener" }, address)),
    h("p", { class: "quiet" }, t("devices.scan")),
    h("p", { class: "trust-print", role: "group", "aria-label": "SHA-256" }, groups(fingerprint).map((word) => h("span", {}, word))),
  ];
}

export function openDevices() {
  openDialog(t("devices.title"), () => {
    const body = h("div", { class: "trust-dialog", "aria-live": "polite" });
    api.devices().then(
      (answer) => fill(body, answer?.offered ? offered(answer.fingerprint) : note(t("devices.none"))),
      (error) => fill(body, note(trouble(error), "bad")),
    );
    return body;
  });
}
