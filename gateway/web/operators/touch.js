// Controls for fingers on a screen, besides handles: a pad for walking, a pad that turns the robot and lifts its body, and three buttons
// that select the effect of dragging a handle.

import { element } from "../src/dom.js";

/** Distance from its middle, in shares of its radius, below which a pad has no effect. */
const DEAD_SHARE = 0.15;
/** Effects of dragging a handle: along the picture, along the line of sight, or a turn. */
const DRAGS = { across: "Across", along: "In, out", turn: "Turn" };

/** Returns true if a person points with fingers and not with a mouse. */
export const byTouch = () => matchMedia("(pointer: coarse)").matches;

/** The two pads and the buttons between them. */
export class Touch {
  drag = "across";

  constructor() {
    this.walk = new Pad("walk", "Walk: push to where the robot is to go", { up: "ahead", left: "◀", right: "▶", down: "back" });
    this.turn = new Pad("turn", "Turn to a side, or rise and sink", { up: "rise", left: "↺", right: "↻", down: "sink" });
    this.choices = Object.entries(DRAGS).map(([drag, text]) => element("button", { type: "button", onclick: () => this.choose(drag) }, text));
    this.parts = [this.walk.node, element("div", { class: "drags tools", role: "group", "aria-label": "What dragging a hand does" }, ...this.choices), this.turn.node];
    this.choose(this.drag);
  }

  /** @param {string} drag */
  choose(drag) {
    this.drag = drag;
    this.choices.forEach((choice, index) => choice.setAttribute("aria-pressed", String(Object.keys(DRAGS)[index] === drag)));
  }

  /**
   * Returns the requests of the pads: shares ahead, to the left, of a left turn, and up. A thumb that turns
   * does not lift at the same time.
   */
  wanted() {
    const [right, down] = this.walk.at;
    const [clockwise, sinks] = this.turn.at;
    const turns = Math.abs(clockwise) > Math.abs(sinks);
    return { base: [-down, -right, turns ? -clockwise : 0], height: turns ? 0 : -sinks };
  }
}

/** A round pad that reports a thumb's offset to the right and down, in shares of its radius. */
class Pad {
  at = [0, 0];

  /** @param {string} name @param {string} label @param {Record<string, string>} signs */
  constructor(name, label, signs) {
    this.knob = element("span", { class: "knob" });
    this.node = element("div", {
      class: `pad ${name}`, role: "group", "aria-label": label,
      onpointerdown: ({ pointerId, clientX, clientY }) => { this.node.setPointerCapture(pointerId); this.push(clientX, clientY); },
      onpointermove: ({ pointerId, clientX, clientY }) => { if (this.node.hasPointerCapture(pointerId)) this.push(clientX, clientY); },
      // The touch ends when the finger is lifted or the system takes over.
      onlostpointercapture: () => this.put([0, 0]),
      oncontextmenu: (event) => event.preventDefault(),
    }, ...Object.entries(signs).map(([place, sign]) => element("span", { class: place, "aria-hidden": "true" }, sign)), this.knob);
  }

  /** @param {number} x @param {number} y */
  push(x, y) {
    const { left, top, width } = this.node.getBoundingClientRect();
    const radius = width / 2;
    const at = [(x - left) / radius - 1, (y - top) / radius - 1];
    const length = Math.hypot(...at);
    this.put(length < DEAD_SHARE ? [0, 0] : at.map((value) => value / Math.max(length, 1)));
  }

  /** @param {number[]} at */
  put(at) {
    this.at = at;
    this.knob.style.transform = `translate(${at.map((value) => `${(80 * value).toFixed(0)}%`).join(", ")})`;
  }
}
