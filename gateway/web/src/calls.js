// The calls of an episode as a list: what was asked, what was answered, what was seen.

import { element, words } from "./dom.js";

const MOST_SHOWN = 400;

export class Calls {
  /** @param {(time: number) => void} [seek] takes the page to a moment */
  constructor(head, seek) {
    this.head = head;
    this.seek = seek;
    this.known = new Map();
    this.list = element("ol", { class: "calls" });
    this.none = element("p", { class: "soft" }, "No call yet.");
    this.node = element("div", {}, this.none, this.list);
  }

  add(call) {
    if (this.known.has(call.number)) return;
    this.none.hidden = true;
    const pictures = element("div", { class: "seen" });
    const asked = parsed(call.arguments);
    const reply = call.ok ? parsed(call.reply) : call.reply;
    const body = element("div", { class: "body" });
    const head = element("summary", {},
      element("span", { class: "number" }, `${call.number}`),
      element("code", {}, call.tool),
      element("span", {}, summary(call, asked, reply)),
      element("span", { class: "soft time" }, `${call.time_s.toFixed(1)} s`));
    const details = element("details", { class: call.ok ? "" : "refused" }, head, body);
    const fill = () => {
      if (body.childNodes.length) return;
      body.append(
        this.seek ? element("button", { onclick: () => this.seek(call.time_s) }, "Go there") : "",
        element("h4", {}, call.operator ? `Asked by ${call.operator}'s operator` : "Asked"), element("pre", {}, text(asked)),
        element("h4", {}, call.ok ? "Answered" : "Refused"), element("pre", {}, text(reply)),
        element("p", { class: "soft" }, `The policy had thought for ${call.thought_s.toFixed(1)} s by then.`));
    };
    details.addEventListener("toggle", fill);
    const item = element("li", {}, details, pictures);
    this.known.set(call.number, pictures);
    this.list.prepend(item);
    if (this.list.childElementCount > MOST_SHOWN) this.list.lastElementChild.remove();
  }

  /** A picture that the policy was shown with a call. */
  picture(number, robot, png) {
    const pictures = this.known.get(number);
    if (!pictures) return;
    const image = element("img", { alt: `What robot ${this.head.robots[robot].name} saw`, width: 160 });
    image.src = URL.createObjectURL(new Blob([png], { type: "image/png" }));
    image.addEventListener("load", () => URL.revokeObjectURL(image.src), { once: true });
    pictures.append(image);
  }
}

const parsed = (json) => {
  try {
    return JSON.parse(json);
  } catch {
    return json;
  }
};

/** As JSON, with rows of numbers on one line and without what is null. */
const text = (value) => (typeof value === "string" ? value
  : JSON.stringify(value, (_, inner) => (inner === null ? undefined : inner), 2).replace(/\[[-\d.,\se]+\]/g, (row) => row.replace(/\s+/g, " ")));

/** A call in a few words. */
function summary(call, asked, reply) {
  if (!call.ok) return `refused: ${reply}`;
  const parts = [];
  const robots = asked?.robots?.map?.((entry) => entry.robot ?? entry) ?? (asked?.robot ? [asked.robot] : []);
  if (robots.length) parts.push(robots.join(" and "));
  if (asked?.text) parts.push(`“${asked.text}”`);
  if (reply?.executed_steps !== undefined) parts.push(`${reply.executed_steps} steps`);
  if (reply?.stop_reason && reply.stop_reason !== "steps_done") parts.push(words(reply.stop_reason));
  const states = reply?.robots?.flatMap?.(({ robot, left, right }) =>
    [["left", left], ["right", right]].filter(([, hand]) => ["blocked", "out_of_reach"].includes(hand?.state)).map(([side, hand]) => `${robot} ${side} ${words(hand.state)}`)) ?? [];
  return [...parts, ...states].join(", ");
}
