// Small plots over simulated time: of hands and joints, one line for each robot and side; of the budget, one line each.

import { colour, element, robotColour, words } from "./dom.js";
import { SIDES } from "./message.js";

const LIVE_SPAN_S = 20;
const HEIGHT = 84;

/** @typedef {import("./message.js").Frame} Frame */
/** @typedef {import("./targets.js").Targets} Targets */
/** @typedef {[number, number]} Point A time and a value. */
/** @typedef {{ arms: number[][], legs: number[][] }} Joints Numbers of a robot's joints, by side. */
/**
 * A plot of steps: a name, a unit, and a number of each robot's left and right.
 * @typedef {{ name: string, unit: string, least: number, of: (frame: Frame, robot: number, side: number, joints: Joints, targets: Targets | null) => number }} Plot
 */
/**
 * A plot with its lines by robot and side.
 * @typedef {Plot & { canvas: HTMLCanvasElement, now: HTMLElement, series: number[][][] }} DrawnPlot
 */

/** @type {Plot[]} */
const PLOTS = [
  { name: "Wrist error", unit: "mm", least: 20, of: (frame, robot, side, joints, targets) => {
    const error = frame.hand(robot, side).positionError;
    return 1000 * (targets?.error(frame, robot, side, error) ?? error);
  } },
  { name: "Force on hand", unit: "N", least: 10, of: (frame, robot, side) => Math.hypot(...frame.hand(robot, side).felt) },
  { name: "Arm effort", unit: "% of limit", least: 50, of: (frame, robot, side, joints) => 100 * frame.effort(robot, joints.arms[side]) },
  { name: "Leg effort", unit: "% of limit", least: 50, of: (frame, robot, side, joints) => 100 * frame.effort(robot, joints.legs[side]) },
];

/** Plots of hands and joints. */
export class Plots {
  /**
   * @param {import("./message.js").SceneHead} head
   * @param {Targets | null} targets those of a finished episode
   */
  constructor(head, targets) {
    this.head = head;
    this.targets = targets;
    /** @type {number[]} */
    this.times = [];
    this.joints = head.robots.map(({ joints }) => ({
      arms: SIDES.map((side) => indices(joints, side, /shoulder|elbow|wrist|hand/)),
      legs: SIDES.map((side) => indices(joints, side, /hip|knee|ankle/)),
    }));
    this.plots = PLOTS.map((plot) => {
      const canvas = element("canvas", { height: HEIGHT, role: "img", "aria-label": `${plot.name} over time` });
      const now = element("span", { class: "soft" });
      return { ...plot, canvas, now, series: head.robots.map(() => SIDES.map(() => /** @type {number[]} */ ([]))) };
    });
    const legend = element("p", { class: "legend" }, ...head.robots.map(({ name }, robot) =>
      element("span", {}, element("i", { class: `swatch robot${robot % 3}` }), name)), element("span", { class: "soft" }, "full line left, dashed right"));
    this.node = element("div", {}, legend, element("div", { class: "plots" }, ...this.plots.map(({ name, unit, canvas, now }) =>
      element("figure", {}, element("figcaption", {}, element("b", {}, name), ` [${unit}] `, now), canvas))));
  }

  /** Adds a step. @param {Frame} frame */
  add(frame) {
    if (this.times.length && frame.time <= this.times[this.times.length - 1]) return;
    this.times.push(frame.time);
    for (const plot of this.plots) {
      plot.series.forEach((sides, robot) => sides.forEach((line, side) => line.push(plot.of(frame, robot, side, this.joints[robot], this.targets))));
    }
  }

  /** Removes the data that a live plot no longer shows. */
  trim() {
    const end = this.times[this.times.length - 1];
    const from = this.times.findIndex((time) => time >= end - LIVE_SPAN_S);
    if (from < 500) return;
    this.times.splice(0, from);
    for (const plot of this.plots) for (const line of plot.series.flat()) line.splice(0, from);
  }

  /**
   * Draws up to the present. With `cursor`, draws the whole episode and the shown moment.
   * @param {number | null} cursor
   * @param {number[]} marks
   */
  draw(cursor, marks) {
    if (!this.times.length) return;
    const end = this.times[this.times.length - 1];
    const begin = cursor === null ? Math.max(this.times[0], end - LIVE_SPAN_S) : this.times[0];
    for (const plot of this.plots) this.drawOne(plot, begin, Math.max(end, begin + 1), cursor, marks);
  }

  /**
   * @param {DrawnPlot} plot
   * @param {number} begin
   * @param {number} end
   * @param {number | null} cursor
   * @param {number[]} marks
   */
  drawOne({ canvas, series, least, now, unit }, begin, end, cursor, marks) {
    const first = Math.max(0, this.times.findIndex((time) => time >= begin));
    const lines = series.flat().map((values, index) => ({ times: this.times, values, first, stroke: robotColour(Math.floor(index / 2)), dash: index % 2 ? [4, 3] : [] }));
    drawLines(canvas, lines, { begin, end, least, cursor, marks });
    const at = cursor === null ? this.times.length - 1 : Math.max(0, this.times.findIndex((time) => time >= cursor));
    const values = series.map((sides, robot) => `${this.head.robots[robot].name} ${sides.map((line) => line[at]?.toFixed(0)).join(" / ")}`);
    now.textContent = values.join(", ");
    canvas.setAttribute("aria-label", `${words(unit)}: ${now.textContent}`);
  }
}

/**
 * Plots of the budget that a finished episode has used up to each moment. Each number changes with calls and notes.
 */
export class BudgetPlots {
  /** @param {import("./message.js").WatchedHead} head @param {Frame[]} frames */
  constructor(head, frames) {
    const end = frames[frames.length - 1].time;
    this.span = [frames[0].time, end];
    const steps = head.episode_steps;
    /** @type {Point[]} */
    const budget = frames.map((frame) => [frame.time, 100 * Math.max(0, 1 - frame.step / steps)]);
    /** @type {{ name: string, unit: string, least: number, digits?: number, points: Point[] }[]} */
    const known = [
      { name: "Steps left", unit: "%", least: 100, points: budget },
      { name: "Calls", unit: "so far", least: 5, points: sums(head.story, (entry) => (entry.kind === "call" && entry.number !== null ? 1 : 0)) },
      { name: "Thinking", unit: "s so far", least: 1, points: head.story.map((entry) => [entry.time_s, entry.thought_s]) },
      { name: "Tokens", unit: "thousands so far", least: 1, digits: 1, points: sums(head.story, ({ note }) => ((note?.input_tokens ?? 0) + (note?.output_tokens ?? 0)) / 1000) },
      { name: "Price", unit: "$ so far", least: 0.01, digits: 3, points: sums(head.story, ({ note }) => note?.usd ?? 0) },
    ];
    const { thinking_s: thinkingS } = head;
    if (thinkingS) {
      /** @type {Point[]} */
      const left = head.story.map((entry) => [entry.time_s, 100 * Math.max(0, 1 - entry.thought_s / thinkingS)]);
      known.splice(1, 0, { name: "Time to think left", unit: "%", least: 100, points: [[this.span[0], 100], ...left] });
    }
    this.plots = known.filter(({ points }) => points.some(([, value]) => value > 0)).map((plot) => {
      const canvas = element("canvas", { height: HEIGHT, role: "img", "aria-label": plot.name });
      return { ...plot, canvas, now: element("span", { class: "soft" }) };
    });
    this.node = element("div", { class: "plots" }, ...this.plots.map(({ name, unit, canvas, now }) =>
      element("figure", {}, element("figcaption", {}, element("b", {}, name), ` [${unit}] `, now), canvas)));
  }

  /** Draws the whole episode and the shown moment. @param {number} cursor @param {number[]} marks */
  draw(cursor, marks) {
    const [begin, end] = this.span;
    for (const { canvas, now, name, points, least, digits } of this.plots) {
      // Between two entries the values are constant.
      const held = points.flatMap(([time, value], index) => (index ? [[time, points[index - 1][1]], [time, value]] : [[time, value]]));
      if (held.length) held.push([end, held[held.length - 1][1]]);
      const line = { times: held.map(([time]) => time), values: held.map(([, value]) => value), first: 0, stroke: colour("--accent"), dash: [] };
      drawLines(canvas, [line], { begin, end: Math.max(end, begin + 1), least, cursor, marks });
      const last = points.findLast(([time]) => time <= cursor + 1e-6);
      now.textContent = last ? last[1].toFixed(digits ?? 0) : "";
      canvas.setAttribute("aria-label", `${name}: ${now.textContent}`);
    }
  }
}

/**
 * Returns sums over the entries so far.
 * @param {import("./message.js").Entry[]} story
 * @param {(entry: import("./message.js").Entry) => number} of
 * @returns {Point[]}
 */
function sums(story, of) {
  let sum = 0;
  return story.map((entry) => [entry.time_s, sum += of(entry)]);
}

/**
 * Draws lines over time.
 * @param {HTMLCanvasElement} canvas
 * @param {{ times: number[], values: number[], first: number, stroke: string, dash: number[] }[]} lines
 * @param {{ begin: number, end: number, least: number, cursor: number | null, marks: number[] }} span
 */
function drawLines(canvas, lines, { begin, end, least, cursor, marks }) {
  const width = canvas.clientWidth;
  if (!width) return;
  const scale = Math.min(devicePixelRatio, 2);
  canvas.width = width * scale;
  canvas.height = HEIGHT * scale;
  // Lines are drawn on a canvas by the processor. A software renderer for WebGL would take many times as long for them.
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) return;
  context.scale(scale, scale);
  let most = least;
  for (const { values, first } of lines) for (let i = first; i < values.length; i += 1) most = Math.max(most, values[i]);
  const x = (/** @type {number} */ time) => ((time - begin) / (end - begin)) * (width - 34);
  const y = (/** @type {number} */ value) => HEIGHT - 4 - (value / most) * (HEIGHT - 12);
  context.fillStyle = context.strokeStyle = colour("--line");
  for (const time of marks) context.fillRect(x(time), 0, 1, HEIGHT);
  context.fillRect(0, y(0), width - 34, 1);
  context.fillRect(0, y(most), width - 34, 1);
  context.fillStyle = colour("--soft");
  context.font = "11px system-ui, sans-serif";
  context.fillText(most < 1 ? most.toFixed(2) : most.toFixed(0), width - 30, y(most) + 9);
  context.fillText("0", width - 30, y(0) + 1);
  for (const { times, values, first, stroke, dash } of lines) {
    context.beginPath();
    context.setLineDash(dash);
    context.strokeStyle = stroke;
    context.lineWidth = 1.5;
    // The number of points is limited to the number of columns.
    const stride = Math.max(1, Math.floor((values.length - first) / width));
    for (let i = first; i < values.length; i += stride) context.lineTo(x(times[i]), y(values[i]));
    context.stroke();
  }
  context.setLineDash([]);
  if (cursor !== null) {
    context.fillStyle = colour("--ink");
    context.fillRect(x(cursor), 0, 1.5, HEIGHT);
  }
}

/**
 * Returns the numbers of joints of a side and a kind.
 * @param {string[]} joints
 * @param {string} side
 * @param {RegExp} kind
 */
function indices(joints, side, kind) {
  return joints.flatMap((name, index) => (name.startsWith(side) && kind.test(name) ? [index] : []));
}
