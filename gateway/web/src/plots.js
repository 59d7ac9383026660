// Small plots over simulated time: one line for each robot and side.

import { colour, element, robotColour, words } from "./dom.js";
import { SIDES } from "./message.js";

const LIVE_SPAN_S = 20;
const HEIGHT = 84;

/** What is plotted of a step: a name, a unit, and a number of each robot's left and right. */
const PLOTS = [
  { name: "Wrist error", unit: "mm", least: 20, of: (frame, robot, side, joints, targets) => {
    const error = frame.hand(robot, side).positionError;
    return 1000 * (targets?.error(frame, robot, side, error) ?? error);
  } },
  { name: "Force on hand", unit: "N", least: 10, of: (frame, robot, side) => Math.hypot(...frame.hand(robot, side).felt) },
  { name: "Arm effort", unit: "% of limit", least: 50, of: (frame, robot, side, joints) => 100 * frame.effort(robot, joints.arms[side]) },
  { name: "Leg effort", unit: "% of limit", least: 50, of: (frame, robot, side, joints) => 100 * frame.effort(robot, joints.legs[side]) },
];

export class Plots {
  /** @param {import("./targets.js").Targets | null} targets those of a finished episode */
  constructor(head, targets) {
    this.head = head;
    this.targets = targets;
    this.times = [];
    this.joints = head.robots.map(({ joints }) => ({
      arms: SIDES.map((side) => indices(joints, side, /shoulder|elbow|wrist|hand/)),
      legs: SIDES.map((side) => indices(joints, side, /hip|knee|ankle/)),
    }));
    this.plots = PLOTS.map((plot) => {
      const canvas = element("canvas", { height: HEIGHT, role: "img", "aria-label": `${plot.name} over time` });
      const now = element("span", { class: "soft" });
      return { ...plot, canvas, now, series: head.robots.map(() => SIDES.map(() => [])) };
    });
    const legend = element("p", { class: "legend" }, ...head.robots.map(({ name }, robot) =>
      element("span", {}, element("i", { class: `swatch robot${robot % 3}` }), name)), element("span", { class: "soft" }, "full line left, dashed right"));
    this.node = element("div", {}, legend, element("div", { class: "plots" }, ...this.plots.map(({ name, unit, canvas, now }) =>
      element("figure", {}, element("figcaption", {}, element("b", {}, name), ` [${unit}] `, now), canvas))));
  }

  /** Adds a step. */
  add(frame) {
    if (this.times.length && frame.time <= this.times.at(-1)) return;
    this.times.push(frame.time);
    for (const plot of this.plots) {
      plot.series.forEach((sides, robot) => sides.forEach((line, side) => line.push(plot.of(frame, robot, side, this.joints[robot], this.targets))));
    }
  }

  /** Forgets what a live plot shows no more. */
  trim() {
    const from = this.times.findIndex((time) => time >= this.times.at(-1) - LIVE_SPAN_S);
    if (from < 500) return;
    this.times.splice(0, from);
    for (const plot of this.plots) for (const line of plot.series.flat()) line.splice(0, from);
  }

  /** Draws up to the present; with `cursor`, the whole episode and where it is looked at. */
  draw(cursor, marks) {
    if (!this.times.length) return;
    const end = this.times.at(-1);
    const begin = cursor === null ? Math.max(this.times[0], end - LIVE_SPAN_S) : this.times[0];
    for (const plot of this.plots) this.drawOne(plot, begin, Math.max(end, begin + 1), cursor, marks);
  }

  drawOne({ canvas, series, least, now, unit }, begin, end, cursor, marks) {
    const width = canvas.clientWidth;
    if (!width) return;
    const scale = Math.min(devicePixelRatio, 2);
    canvas.width = width * scale;
    canvas.height = HEIGHT * scale;
    const context = canvas.getContext("2d");
    context.scale(scale, scale);
    const first = this.times.findIndex((time) => time >= begin);
    const lines = series.flat();
    let most = least;
    for (const line of lines) for (let i = first; i < line.length; i += 1) most = Math.max(most, line[i]);
    const x = (time) => ((time - begin) / (end - begin)) * (width - 34);
    const y = (value) => HEIGHT - 4 - (value / most) * (HEIGHT - 12);
    context.fillStyle = context.strokeStyle = colour("--line");
    for (const time of marks) context.fillRect(x(time), 0, 1, HEIGHT);
    context.fillRect(0, y(0), width - 34, 1);
    context.fillRect(0, y(most), width - 34, 1);
    context.fillStyle = colour("--soft");
    context.font = "11px system-ui, sans-serif";
    context.fillText(most.toFixed(0), width - 30, y(most) + 9);
    context.fillText("0", width - 30, y(0) + 1);
    lines.forEach((line, index) => {
      context.beginPath();
      context.setLineDash(index % 2 ? [4, 3] : []);
      context.strokeStyle = robotColour(Math.floor(index / 2));
      context.lineWidth = 1.5;
      // No more points than there are places for them.
      const stride = Math.max(1, Math.floor((line.length - first) / width));
      for (let i = first; i < line.length; i += stride) context.lineTo(x(this.times[i]), y(line[i]));
      context.stroke();
    });
    context.setLineDash([]);
    if (cursor !== null) {
      context.fillStyle = colour("--ink");
      context.fillRect(x(cursor), 0, 1.5, HEIGHT);
    }
    const at = cursor === null ? this.times.length - 1 : Math.max(0, this.times.findIndex((time) => time >= cursor));
    const values = series.map((sides, robot) => `${this.head.robots[robot].name} ${sides.map((line) => line[at]?.toFixed(0)).join(" / ")}`);
    now.textContent = values.join(", ");
    canvas.setAttribute("aria-label", `${words(unit)}: ${now.textContent}`);
  }
}

function indices(joints, side, kind) {
  return joints.flatMap((name, index) => (name.startsWith(side) && kind.test(name) ? [index] : []));
}
