// Calls, answers, images and notes of an episode, as a list. For a running episode the latest entry is first. For a finished one the first
// entry is first, and the list scrolls to the shown moment.

import { element, words } from "./dom.js";

const MOST_SHOWN = 400;
/** Minimum thinking time that is shown. */
const LEAST_THOUGHT_S = 0.5;
/** Number of letters of a note or a refusal that are shown before the reader opens it. */
const SHORT_NOTE = 280;

/** @typedef {import("./message.js").Entry} Entry */
/** @typedef {import("./message.js").CallEntry} CallEntry */
/** @typedef {{ time: number, item: HTMLElement }} Item An entry of the list, and its moment. */

/** The list of an episode's calls and notes. */
export class Story {
  /**
   * @param {import("./message.js").SceneHead} head
   * @param {{ seek: (time: number) => void, picture: (robot: string, time: number) => string } | null} recorded of a finished episode:
   *   moves the page to a moment, and returns the address of a picture
   */
  constructor(head, recorded) {
    this.head = head;
    this.recorded = recorded;
    /** Pictures of the entries that are in the list, by number. @type {Map<number, HTMLElement | null>} */
    this.known = new Map();
    /** @type {Item[]} */
    this.entries = [];
    this.thought = 0;
    /** @type {HTMLElement | undefined} */
    this.marked = undefined;
    /**
     * Adds a person's command to the item of earlier ones, if the last entry is such an item.
     * @type {((entry: CallEntry) => void) | null}
     */
    this.driven = null;
    this.list = element("ol", { class: "story" });
    this.none = element("p", { class: "soft" }, "No call yet.");
    this.node = element("div", { class: recorded ? "reader" : "" }, this.none, this.list);
    if (recorded) new ResizeObserver(() => this.bringIntoSight()).observe(this.node);
  }

  /** Adds a call or a note. @param {Entry} entry */
  add(entry) {
    if (this.known.has(entry.entry)) return;
    this.none.hidden = true;
    if (entry.kind === "call" && isDriven(entry)) {
      if (this.driven) {
        this.known.set(entry.entry, null);
        this.thought = entry.thought_s;
        this.driven(entry);
        return;
      }
    } else {
      this.driven = null;
    }
    const seen = element("div", { class: "seen" });
    const thought = entry.thought_s - this.thought;
    this.thought = entry.thought_s;
    const item = element("li", { class: entry.kind },
      thought >= LEAST_THOUGHT_S ? element("div", { class: "soft pause" }, `thought for ${thought.toFixed(1)} s`) : null,
      entry.kind === "note" ? this.note(entry) : this.call(entry), seen);
    if (this.recorded) {
      for (const robot of entry.seen ?? []) seen.append(this.image(robot, this.recorded.picture(robot, entry.time_s), true));
    }
    this.known.set(entry.entry, seen);
    this.entries.push({ time: entry.time_s, item });
    if (this.recorded) {
      this.list.append(item);
      return;
    }
    this.list.prepend(item);
    if (this.list.childElementCount > MOST_SHOWN) this.list.lastElementChild?.remove();
  }

  /** @param {CallEntry} entry */
  call(entry) {
    const asked = parsed(entry.arguments);
    const reply = entry.ok ? parsed(entry.reply) : entry.reply;
    const body = element("div", { class: "body" });
    const number = element("span", { class: "number" }, entry.number === null ? "–" : `${entry.number}`);
    const inShort = element("span", {}, summary(entry, asked, reply));
    const head = element("summary", {}, number, element("code", {}, entry.tool), inShort,
      this.recorded ? null : this.when(entry));
    const details = element("details", { class: entry.ok ? "" : "refused" }, head, body);
    if (isDriven(entry)) {
      this.goesOn(entry, number, inShort, body);
      return this.recorded ? element("div", { class: "call" }, details, this.when(entry)) : details;
    }
    details.addEventListener("toggle", () => {
      if (body.childNodes.length) return;
      body.append(
        entry.number === null ? element("p", { class: "soft" }, entry.ok ? "The commands before it are those of this plan."
          : "It was refused before it reached the episode, and does not count.") : "",
        element("h3", {}, entry.operator ? `Asked by ${entry.operator}'s operator` : "Asked"), element("pre", { tabindex: 0 }, text(asked)),
        element("h3", {}, entry.ok ? "Answered" : "Refused"), element("pre", { tabindex: 0 }, text(reply)),
        element("p", { class: "soft" }, `The policy had thought for ${entry.thought_s.toFixed(1)} s by then.`));
    });
    return this.recorded ? element("div", { class: "call" }, details, this.when(entry)) : details;
  }

  /**
   * Begins the item of people's commands, which grows by 50 a second.
   * @param {CallEntry} first
   * @param {HTMLElement} number
   * @param {HTMLElement} told
   * @param {HTMLElement} body
   */
  goesOn(first, number, told, body) {
    let count = 0;
    /** @param {CallEntry} entry */
    const driven = (entry) => {
      count += 1;
      number.textContent = count > 1 ? `${first.number}–${entry.number}` : `${entry.number}`;
      told.textContent = `people drive, up to ${entry.time_s.toFixed(1)} s: ${count} ${count > 1 ? "commands" : "command"} of a step`;
    };
    driven(first);
    this.driven = driven;
    body.append(element("p", { class: "soft" }, "What each robot was to do, 50 times a second. The recording has all of it."));
  }

  /** @param {import("./message.js").NoteEntry} entry */
  note(entry) {
    const { note } = entry;
    const who = [note.robot ?? "", note.kind, note.model ?? ""].filter(Boolean).join(", ");
    const long = note.text.length > SHORT_NOTE;
    const said = element("p", { class: long ? "said long" : "said" }, note.text);
    return element("div", {},
      element("div", { class: "line" }, element("span", { class: "soft" }, who), this.when(entry)), note.text ? said : null,
      long ? element("button", { class: "more", onclick: (event) => { said.classList.remove("long"); event.target.remove(); } }, "All of it") : null,
      used(note) ? element("p", { class: "soft" }, used(note)) : null);
  }

  /** @param {Entry} entry */
  when(entry) {
    const told = `${entry.time_s.toFixed(1)} s`;
    const { recorded } = this;
    if (!recorded) return element("span", { class: "soft time" }, told);
    const go = (/** @type {Event} */ event) => {
      event.preventDefault();
      recorded.seek(entry.time_s);
    };
    return element("button", { class: "time", title: "Go there", onclick: go }, told);
  }

  /** @param {string} robot @param {string} src @param {boolean} later */
  image(robot, src, later) {
    return element("img", { alt: `What robot ${robot} saw`, title: `What robot ${robot} saw`, width: 160, height: 120, src, loading: later ? "lazy" : null });
  }

  /**
   * Shows a picture that the policy was shown with a call.
   * @param {number} entry
   * @param {number} robot
   * @param {ArrayBuffer} png
   */
  picture(entry, robot, png) {
    const seen = this.known.get(entry);
    if (!seen) return;
    const image = this.image(this.head.robots[robot].name, URL.createObjectURL(new Blob([png], { type: "image/png" })), false);
    image.addEventListener("load", () => URL.revokeObjectURL(image.src), { once: true });
    seen.append(image);
  }

  /** Marks the last entry before a moment. @param {number} time */
  follow(time) {
    const next = this.entries.findIndex((entry) => entry.time > time + 1e-6);
    const item = this.entries[(next < 0 ? this.entries.length : next) - 1]?.item;
    if (item === this.marked) return;
    this.marked?.removeAttribute("aria-current");
    this.marked = item;
    if (!this.marked) return;
    this.marked.setAttribute("aria-current", "step");
    this.bringIntoSight();
  }

  /** Scrolls only the list, and not the page. */
  bringIntoSight() {
    const { node, marked } = this;
    if (!marked) return;
    node.scrollTop = Math.max(0, marked.offsetTop - node.offsetTop - node.clientHeight / 3);
  }
}

/**
 * Returns true if a call is one of the single-step commands by which people drive.
 * @param {CallEntry} call
 */
const isDriven = ({ ok, tool, reply }) => ok && tool === "together" && /"executed_steps":\s*1\D/.test(reply);

const parsed = (/** @type {string} */ json) => {
  try {
    return JSON.parse(json);
  } catch {
    return json;
  }
};

/**
 * Writes a value as readable JSON: rows of numbers on one line, numbers with six digits, and no null
 * fields.
 */
const text = (/** @type {unknown} */ value) => (typeof value === "string" ? value
  : JSON.stringify(value, (_, inner) => readable(inner), 2).replace(/\[[-\d.,\se]+\]/g, (row) => row.replace(/\s+/g, " ")));
const readable = (/** @type {unknown} */ value) => {
  if (value === null) return undefined;
  return typeof value === "number" && !Number.isInteger(value) ? Number(value.toPrecision(6)) : value;
};

/** Describes the usage in a note. @param {import("./message.js").Note} note */
export function used({ input_tokens: input, output_tokens: output, cached_tokens: cached, usd, seconds }) {
  /** @type {string[]} */
  const parts = [];
  if (input !== undefined) parts.push(`${input} tokens read${cached ? ` (${cached} from a cache)` : ""}, ${output} written`);
  if (usd !== undefined) parts.push(`$${usd.toFixed(usd < 0.1 ? 4 : 2)}`);
  if (seconds !== undefined) parts.push(`${seconds.toFixed(1)} s`);
  return parts.join("; ");
}

/** Summarises a call in a few words. @param {CallEntry} call @param {any} asked @param {any} reply */
function summary(call, asked, reply) {
  if (!call.ok) {
    // The following example is for the policy. It is shown when the call is opened.
    const [why] = reply.split("; arguments that work");
    return `refused: ${why.length > SHORT_NOTE ? `${why.slice(0, SHORT_NOTE)}...` : why}`;
  }
  const parts = [];
  const robots = asked?.robots?.map?.((/** @type {any} */ entry) => entry.robot ?? entry) ?? (asked?.robot ? [asked.robot] : []);
  if (robots.length) parts.push(robots.join(" and "));
  if (asked?.text) parts.push(`“${asked.text}”`);
  if (reply?.commands !== undefined) parts.push(`${reply.commands} commands`);
  if (reply?.executed_steps !== undefined) parts.push(`${reply.executed_steps} steps`);
  if (reply?.stopped) parts.push(reply.stopped);
  if (reply?.stop_reason && reply.stop_reason !== "steps_done") parts.push(words(reply.stop_reason));
  const states = reply?.robots?.flatMap?.((/** @type {any} */ { robot, left, right }) =>
    [["left", left], ["right", right]].filter(([, hand]) => ["blocked", "out_of_reach"].includes(hand?.state)).map(([side, hand]) => `${robot} ${side} ${words(hand.state)}`)) ?? [];
  return [...parts, ...states].join(", ");
}
