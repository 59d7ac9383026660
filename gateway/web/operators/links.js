// A link for a person at this screen, and as a QR code for one with a telephone or a headset.

import { element } from "../src/dom.js";

/** A row of a list: the link, its QR code below, and further text. `token` is that of whoever shows it. */
export async function linkRow(name, href, token, text = "") {
  const link = element("a", { href, target: "_blank", rel: "noopener" }, name);
  return element("li", {}, link, text && ` ${text}`, await code(href, token));
}

/** The QR code of a text, which is sent as a body: addresses are written to logs. */
async function code(text, token) {
  const headers = { "content-type": "application/json", ...(token ? { authorization: `Bearer ${token}` } : {}) };
  const answer = await fetch("/operate/code", { method: "POST", headers, body: JSON.stringify({ text }), credentials: "omit" });
  if (!answer.ok) return null;
  const url = URL.createObjectURL(await answer.blob());
  return element("details", {}, element("summary", {}, "QR code"), element("img", { class: "code", src: url, alt: "QR code of this link" }));
}
