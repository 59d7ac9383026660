// Wrist targets of a finished episode, which its steps do not contain. They come from the replies to its commands, in the robot's pelvis
// frame at the command's end. During a command, a target is fixed in the world.

import { Quaternion, Vector3 } from "three";
import { POSE, SIDES } from "./message.js";

/** The tools whose replies contain wrist targets. People's commands use the second one. */
const TELLING = ["move_wrists", "together"];

/** @typedef {{ begin: number, end: number, pose: Float32Array, state: string }} Target */

/** The wrist targets of a finished episode. */
export class Targets {
  /** @param {import("./message.js").WatchedScene} scene */
  constructor({ head, layout, frames }) {
    /** By robot and side: targets in order, with the times of their beginning and end. */
    this.known = head.robots.map(() => SIDES.map(() => /** @type {Target[]} */ ([])));
    let begin = 0;
    let latest = 0;
    for (const call of head.story) {
      const reply = call.kind === "call" && call.ok && TELLING.includes(call.tool) ? JSON.parse(call.reply) : null;
      while (frames[latest + 1]?.time <= call.time_s + 1e-6) latest += 1;
      const frame = frames[latest];
      for (const told of reply?.robots ?? []) {
        const robot = head.robots.findIndex(({ name }) => name === told.robot);
        if (robot < 0 || !told.left?.target || !told.right?.target) continue;
        SIDES.forEach((side, index) => {
          const pose = inWorld(frame.row, layout.links[robot], told[side].target);
          this.known[robot][index].push({ begin, end: call.time_s, pose, state: told[side].state ?? "moving" });
        });
      }
      begin = call.time_s;
    }
  }

  /**
   * Returns the target of a hand at a time, or null if no command with a target was being executed.
   * @param {number} time
   * @param {number} robot
   * @param {number} side
   */
  at(time, robot, side) {
    const known = this.known[robot][side];
    let [low, high] = [0, known.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (known[middle].end < time) low = middle + 1;
      else high = middle;
    }
    return known[low]?.begin <= time ? known[low] : null;
  }

  /**
   * Returns the distance of a wrist from its target in metres; `otherwise` without a target.
   * @param {import("./message.js").Frame} frame
   * @param {number} robot
   * @param {number} side
   * @param {number} otherwise
   */
  error(frame, robot, side, otherwise) {
    const target = this.at(frame.time, robot, side);
    if (!target) return otherwise;
    const { wrist } = frame.hand(robot, side);
    return Math.hypot(...[0, 1, 2].map((axis) => frame.row[wrist + axis] - target.pose[axis]));
  }
}

/**
 * Returns a pose of a pelvis frame in the world.
 * @param {Float32Array} row
 * @param {number} pelvis place of the pelvis in the row
 * @param {{ position_m: number[], quaternion_wxyz: number[] }} pose
 */
function inWorld(row, pelvis, { position_m: position, quaternion_wxyz: [w, x, y, z] }) {
  const turn = new Quaternion().fromArray(row, pelvis + 3);
  const at = new Vector3().fromArray(position).applyQuaternion(turn).add(new Vector3().fromArray(row, pelvis));
  const turned = turn.multiply(new Quaternion(x, y, z, w));
  const pose = new Float32Array(POSE);
  at.toArray(pose);
  turned.toArray(pose, 3);
  return pose;
}
