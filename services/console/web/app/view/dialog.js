// Dialogs by the browser's own <dialog>: focus is kept inside and given back, Escape closes.

import { h, iconButton } from "./dom.js";
import { t } from "../words/text.js";

let count = 0;

/** Opens a dialog; `make(close)` gives its inside. One that is not modal leaves the page, and so the stop button, in reach. */
export function openDialog(title, make, { modal = true } = {}) {
  count += 1;
  const id = `dialog-${count}`;
  const dialog = h("dialog", { "aria-labelledby": id });
  const close = () => dialog.close();
  dialog.append(
    h("div", { class: "dialog-head" }, h("h2", { id }, title), iconButton(t("app.close"), "cross", { onclick: close })),
    make(close),
  );
  dialog.addEventListener("close", () => dialog.remove());
  document.body.append(dialog);
  if (modal) dialog.showModal();
  else {
    dialog.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      close();
    });
    dialog.show();
  }
  dialog.querySelector("input:not([type=hidden]), select, textarea")?.focus();
  return close;
}
