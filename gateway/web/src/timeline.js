// The time line of a finished episode: its phases as bands, calls, looks and notes as marks below them, and a slider over the whole time.

import { colour, element, words } from "./dom.js";

const ROW = 13;
const CONTROL_HZ = 50;
/**
 * Rows of marks: name, colour, and a test for the entries in it.
 * @type {{ name: string, colour: string, of: (entry: Stretch) => boolean }[]}
 */
const ROWS = [
  { name: "commands", colour: "--accent", of: (entry) => entry.kind === "call" && entry.ok && entry.number !== null && entry.steps > 0 },
  { name: "looks and questions", colour: "--soft", of: (entry) => entry.kind === "call" && entry.ok && entry.number !== null && !(entry.steps > 0) },
  { name: "refused", colour: "--bad", of: (entry) => entry.kind === "call" && !entry.ok },
  { name: "notes", colour: "--odd", of: (entry) => entry.kind === "note" },
];

/** @typedef {import("./message.js").Entry & { steps: number, from: number }} Stretch */

/** The time line of a finished episode. */
export class Timeline {
  /**
   * @param {import("./message.js").WatchedHead} head
   * @param {import("./time.js").RecordedTime} time
   * @param {import("./message.js").Frame[]} frames
   */
  constructor(head, time, frames) {
    this.head = head;
    this.frames = frames;
    this.time = time;
    this.slider = element("input", {
      type: "range", min: time.begin, max: time.end, step: 0.02, "aria-label": "Moment",
      oninput: (event) => { time.play(false); time.seek(Number(event.target.value)); },
    });
    this.entries = stretches(head.story, time.begin);
    this.rows = ROWS.map((row) => ({ ...row, entries: this.entries.filter(row.of) })).filter(({ entries }) => entries.length);
    this.canvas = element("canvas", { height: this.rows.length * ROW, role: "img", "aria-label": this.told(), onclick: (event) => this.clicked(event) });
    this.hint = element("span", { class: "hint", hidden: true });
    this.canvas.addEventListener("pointermove", (event) => this.pointed(event));
    this.canvas.addEventListener("pointerleave", () => { this.hint.hidden = true; });
    const legend = element("p", { class: "legend" }, ...this.rows.map((row) =>
      element("span", {}, element("i", { class: `swatch ${row.colour.slice(2)}` }), `${row.name} (${row.entries.length})`)));
    this.node = element("div", { class: "track" }, this.slider, this.bands(), this.falls(), this.canvas, this.hint, legend);
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
  }

  /**
   * Makes the bands. A phase lasts from the time at which the one before was reached to its own time, or to the end if
   * it was not reached.
   */
  bands() {
    const { begin, end } = this.time;
    const reached = new Map(this.head.reached.map((phase) => [phase.number, phase.time_s]));
    let from = begin;
    const bands = [];
    for (const { number, id } of this.head.phases) {
      const at = reached.get(number);
      const until = at ?? end;
      if (until - from > 1e-6 || at !== undefined) {
        const told = at === undefined ? `${number} ${words(id)}: not reached` : `${number} ${words(id)}: reached at ${at.toFixed(2)} s`;
        const band = element("button", { class: at === undefined ? "missed" : "done", title: told, onclick: () => this.time.seek(until) },
          `${number} ${words(id)}`);
        band.style.width = `${(100 * (until - from)) / (end - begin)}%`;
        bands.push(band);
      }
      from = until;
      if (at === undefined) break;
    }
    return element("div", { class: "bands" }, ...bands);
  }

  /** Makes the marks of falls. */
  falls() {
    const { begin, end } = this.time;
    const marks = this.head.robots.flatMap(({ name }, robot) => {
      const fall = this.frames.find((frame) => frame.fallen(robot));
      if (!fall) return [];
      const mark = element("button", { title: `Robot ${name} fell at ${fall.time.toFixed(1)} s`, onclick: () => this.time.seek(fall.time) }, `${name} fell`);
      mark.style.left = `${(100 * (fall.time - begin)) / (end - begin)}%`;
      return [mark];
    });
    return marks.length ? element("div", { class: "falls" }, ...marks) : null;
  }

  told() {
    return this.rows.map(({ name, entries }) => `${entries.length} ${name}`).join(", ");
  }

  /** @param {number} time */
  x(time) {
    const { begin, end } = this.time;
    return ((time - begin) / (end - begin)) * this.canvas.clientWidth;
  }

  draw() {
    const { canvas } = this;
    const width = canvas.clientWidth;
    if (!width) return;
    const scale = Math.min(devicePixelRatio, 2);
    canvas.width = width * scale;
    canvas.height = this.rows.length * ROW * scale;
    canvas.style.height = `${this.rows.length * ROW}px`;
    const context = canvas.getContext("2d");
    if (!context) return;
    context.scale(scale, scale);
    this.rows.forEach(({ entries, colour: name }, row) => {
      context.fillStyle = colour("--line");
      context.fillRect(0, row * ROW + ROW - 2, width, 1);
      context.fillStyle = colour(name);
      for (const { from, time_s: until } of entries) {
        const left = this.x(from);
        context.fillRect(left, row * ROW + 1, Math.max(2, this.x(until) - left - 0.7), ROW - 5);
      }
    });
  }

  /** Returns the entry below the pointer, or the nearest within a few pixels. @param {MouseEvent} event */
  under(event) {
    const { left, top, width } = this.canvas.getBoundingClientRect();
    const row = this.rows[Math.floor((event.clientY - top) / ROW)];
    if (!row || !width) return null;
    const x = event.clientX - left;
    const away = (/** @type {Stretch} */ { from, time_s: until }) => Math.max(this.x(from) - x, x - this.x(until), 0);
    const nearest = row.entries.reduce((best, entry) => (away(best) <= away(entry) ? best : entry));
    return away(nearest) < 8 ? nearest : null;
  }

  /** @param {MouseEvent} event */
  pointed(event) {
    const entry = this.under(event);
    this.canvas.style.cursor = entry ? "pointer" : "";
    this.hint.hidden = !entry;
    if (!entry) return;
    this.hint.textContent = entry.kind === "note" ? `${entry.note.kind}: ${entry.note.text.slice(0, 120)}`
      : `${entry.number ?? "–"} ${entry.tool}${entry.ok ? "" : `: ${entry.reply.slice(0, 120)}`}`;
    const { width } = this.canvas.getBoundingClientRect();
    this.hint.style.left = `${Math.min(this.x(entry.from), Math.max(0, width - 260))}px`;
  }

  /** @param {MouseEvent} event */
  clicked(event) {
    const entry = this.under(event);
    this.time.play(false);
    if (entry) {
      this.time.seek(entry.time_s);
      return;
    }
    const { left, width } = this.canvas.getBoundingClientRect();
    const { begin, end } = this.time;
    this.time.seek(begin + ((event.clientX - left) / width) * (end - begin));
  }

  /** Moves to the entry before or after the shown moment. @param {number} way -1 or 1 */
  step(way) {
    const now = this.time.time;
    const times = [...new Set(this.entries.map(({ time_s }) => time_s))];
    const next = way > 0 ? times.find((time) => time > now + 1e-6) : times.findLast((time) => time < now - 1e-6);
    this.time.play(false);
    this.time.seek(next ?? (way > 0 ? this.time.end : this.time.begin));
  }

  show() {
    if (document.activeElement !== this.slider || this.time.playing) this.slider.value = String(this.time.time);
  }
}

/**
 * Returns the entries with their start times. A command lasts as long as its reply states; other entries have no duration.
 * @param {import("./message.js").Entry[]} story
 * @param {number} begin
 * @returns {Stretch[]}
 */
function stretches(story, begin) {
  return story.map((entry) => {
    const steps = entry.kind === "call" && entry.number !== null && entry.ok ? executedSteps(entry.reply) : 0;
    return { ...entry, steps, from: Math.max(begin, entry.time_s - steps / CONTROL_HZ) };
  });
}

/** @param {string} reply @returns {number} */
function executedSteps(reply) {
  try {
    return JSON.parse(reply)?.executed_steps ?? 0;
  } catch {
    return 0;
  }
}
