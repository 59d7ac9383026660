// A link for a person at this screen, and a QR code for a person with a telephone or a headset.

import { copying, element } from "../src/dom.js";
import { bearer } from "./call.js";

/**
 * Makes a row of a list: the link, its QR code below, and further text. `token` is that of the person who shows it.
 * @param {string} name
 * @param {string} href
 * @param {string} token
 * @param {string} [text]
 */
export async function linkRow(name, href, token, text = "") {
  const link = element("a", { href, target: "_blank", rel: "noopener" }, name);
  return element("li", {}, link, " ", copying(() => href, "Copy link"), text && element("div", { class: "soft" }, text), await code(href, token));
}

/**
 * Warns that the links of this page work only on this machine, if they contain an address such as localhost.
 */
export function nearby() {
  const isOwn = /^(localhost|127\.|\[::1\])/.test(location.hostname);
  return element("p", { class: "soft", hidden: !isOwn }, "They open in browsers of this machine alone. For people at others, start the server with ",
    element("code", {}, "--listen 0.0.0.0:8700"), " and open this page by the machine's name or address.");
}

/**
 * Makes the QR code of a text. The text is sent as a body, because addresses are written to logs.
 * @param {string} text
 * @param {string} token
 */
async function code(text, token) {
  const headers = { "content-type": "application/json", ...bearer(token) };
  const answer = await fetch("/operate/code", { method: "POST", headers, body: JSON.stringify({ text }), credentials: "omit" });
  if (!answer.ok) return null;
  const url = URL.createObjectURL(await answer.blob());
  return element("details", {}, element("summary", {}, "QR code"), element("img", { class: "code", src: url, alt: "QR code of this link" }));
}
