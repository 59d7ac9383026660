// Wrist targets of a person for a robot: poses in its pelvis frame, which move with the pelvis. The page shows the person's input
// immediately, and not the targets that the server has received: over a slow connection the hand follows its handle.

import { Quaternion, Vector3 } from "three";
import { POSE, SIDES, bySide } from "../src/message.js";

/** Maximum distance of a target from its wrist, so that targets dragged into a table do not run away. */
const LEASH_M = 0.2;
const LEASH_RAD = 1;
/** Offset from a wrist to the middle of its palm, where its handle is. */
const PALM_IN_WRIST_M = [0.1, 0, 0];

/** @typedef {import("../src/message.js").Side} Side */
/** @typedef {{ position: Vector3, turn: Quaternion }} Pose */

/** The wrist targets of one robot. */
export class Hands {
  /** @type {Record<Side, Vector3 | null>} */
  targets = { left: null, right: null };
  /** @type {Record<Side, Quaternion | null>} */
  turns = { left: null, right: null };

  /** @param {number} robot Its number in the scene. */
  constructor(robot) {
    this.robot = robot;
    this.pelvis = { position: new Vector3(), turn: new Quaternion() };
    this.measured = bySide(() => ({ position: new Vector3(), turn: new Quaternion() }));
  }

  /** Receives a step. @param {import("../src/message.js").Frame} frame */
  see(frame) {
    const { row, layout } = frame;
    readPose(row, layout.links[this.robot], this.pelvis);
    const back = this.pelvis.turn.clone().invert();
    SIDES.forEach((side, index) => {
      const wrist = this.measured[side];
      readPose(row, frame.hand(this.robot, index).wrist, wrist);
      wrist.position.sub(this.pelvis.position).applyQuaternion(back);
      wrist.turn.premultiply(back);
    });
  }

  /** Removes the targets, so the arms keep their posture. */
  letGo() {
    this.targets = { left: null, right: null };
    this.turns = { left: null, right: null };
  }

  /** Moves a target by a displacement in the pelvis frame. @param {Side} side @param {Vector3} by */
  shift(side, by) {
    this.place(side, this.pose(side).position.add(by), this.turns[side]);
  }

  /**
   * Turns a target about an axis of the pelvis frame, within its maximum angle from the wrist.
   * @param {Side} side
   * @param {Vector3} by Its direction is the axis, its length the angle.
   */
  rotate(side, by) {
    const turn = new Quaternion().setFromAxisAngle(by.clone().normalize(), by.length()).multiply(this.pose(side).turn);
    if (turn.angleTo(this.measured[side].turn) < LEASH_RAD) this.place(side, this.pose(side).position, turn);
  }

  /** Turns a target so that the fingers point ahead and the palm to the other hand. @param {Side} side */
  level(side) {
    this.place(side, this.pose(side).position, new Quaternion());
  }

  /**
   * Moves a target to a place in the pelvis frame, within its maximum distance from the wrist. Also turns it if `turn` is given.
   * @param {Side} side
   * @param {Vector3} to
   * @param {Quaternion | null} [turn]
   */
  place(side, to, turn = null) {
    const from = this.measured[side].position;
    this.targets[side] = to.clone().sub(from).clampLength(0, LEASH_M).add(from);
    this.turns[side] = turn;
  }

  /**
   * Returns the target pose of a wrist, or its own pose without a target, in the pelvis frame.
   * @param {Side} side
   * @returns {Pose}
   */
  pose(side) {
    const { position, turn } = this.measured[side];
    return { position: (this.targets[side] ?? position).clone(), turn: (this.turns[side] ?? turn).clone() };
  }

  /** Converts a displacement in the world to the pelvis frame. @param {Vector3} way */
  inPelvis(way) {
    return way.clone().applyQuaternion(this.pelvis.turn.clone().invert());
  }

  /**
   * Returns the place of a handle in the world: the palm of a hand at its target.
   * @param {Side} side
   */
  handle(side) {
    const { position, turn } = this.pose(side);
    const palm = new Vector3().fromArray(PALM_IN_WRIST_M).applyQuaternion(turn).add(position);
    return palm.applyQuaternion(this.pelvis.turn).add(this.pelvis.position);
  }

  /** Returns the wrists' part of a `move_wrists` entry. @returns {Record<string, unknown>} */
  wrists() {
    /** @type {Record<string, unknown>} */
    const move = { carried: true };
    for (const side of SIDES) {
      const { [side]: target } = this.targets;
      const { [side]: turn } = this.turns;
      if (target) move[`${side}_position_m`] = target.toArray();
      if (turn) move[`${side}_quaternion_wxyz`] = [turn.w, turn.x, turn.y, turn.z];
    }
    return move;
  }
}

/** @param {Float32Array} row @param {number} at @param {Pose} pose */
function readPose(row, at, { position, turn }) {
  if (at + POSE > row.length) throw new Error("a row is too short");
  position.fromArray(row, at);
  turn.fromArray(row, at + 3);
}
