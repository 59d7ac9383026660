// A person's tracked hand as the fingers of a Dex3-1: vector retargeting, like in dex-retargeting. It finds the joints whose fingertips
// have the same places relative to the wrist as the person's:
//
//   min_q  sum_i |s v_i - f_i(q)|^2 + m |q - q_before|^2,   low <= q <= high
//
// v_i: 3, from the person's wrist to the tip of finger i, in the wrist's frame [m]; f_i: 3, the same of the robot [m]; q: 7 [rad];
// m: damping [m^2/rad^2]. No joint moves two fingers, so that each finger is solved for by itself, by damped Gauss-Newton steps.
//
// Settings that Unitree publishes for dex-retargeting's Dex3-1 (unitree_dex3.yml of xr_teleoperate): type `vector`, the same tips (4, 9
// and 14 of a hand's 25 joints), scale 1.4, and of each solution a share of 0.2 a frame, at 30 frames a second. Here the filter has the
// same time constant, however often a headset draws. The scale is smaller, because vectors begin at the G1's wrist, 4 cm behind the
// root of the hand's own model where theirs begin; and the thumb's begins there, too, and not at its own base, so that a pinch of the
// person's is one of the robot's.

import { Matrix4, Quaternion, Vector3 } from "three";

/** @typedef {import("../../src/message.js").Side} Side */

/**
 * Joints of WebXR's hands, and the finger joints that follow each, in the order of commands: thumb, middle and
 * index finger.
 */
const FINGERS = [{ tip: 4, chain: [0, 1, 2] }, { tip: 14, chain: [3, 4] }, { tip: 9, chain: [5, 6] }];
/** Straight, the index finger of a Dex3-1 ends 0.21 m before the wrist, that of a grown person 0.18 m. */
const SCALE = 1.15;
/** A share of 0.2 of each of 30 frames a second. */
const LOW_PASS_S = -1 / 30 / Math.log(1 - 0.2);
const DAMPING_M2 = 2e-5;
const STEPS = 4;
const DIFFERENCE_RAD = 1e-4;

/**
 * Axes of a G1's wrist (x to the fingers, z to the index finger's side) in those of WebXR (-z to the fingers, y
 * to the back of the hand).
 */
const ROBOT_AXES = {
  left: turnOf([0, 0, -1], [0, 1, 0], [1, 0, 0]),
  right: turnOf([0, 0, -1], [0, -1, 0], [-1, 0, 0]),
};

/**
 * Returns the orientation of a robot's wrist for that of a person's wrist.
 * @param {Side} side
 * @param {Quaternion} turn
 */
export const robotTurn = (side, turn) => turn.clone().multiply(ROBOT_AXES[side]);

/** The fingers of one hand. */
export class Fingers {
  /**
   * @param {Side} side
   * @param {import("../../src/message.js").FingerJoint[]} joints Those of the hand, in the order of commands; each turns in
   *   the frame of the one before it in its finger, and the first in that of the wrist.
   */
  constructor(side, joints) {
    this.side = side;
    this.joints = joints.map(({ pose, axis, range_rad: range }) => ({
      at: new Vector3().fromArray(pose), turn: new Quaternion().fromArray(pose, 3), axis: new Vector3().fromArray(axis), range,
    }));
    this.sought = this.joints.map(({ range: [low, high] }) => Math.max(low, Math.min(high, 0)));
    /** Joint angles to command, in radians. */
    this.angles = [...this.sought];
  }

  /**
   * Follows a hand for the time that has passed.
   * @param {(number[] | null)[]} positions Places of its 25 joints in metres, in the space of the headset; null where one is not seen.
   * @param {Quaternion} wristTurn Orientation of its wrist there.
   * @param {number} passedS
   */
  follow(positions, wristTurn, passedS) {
    const [wrist] = positions;
    if (!wrist) return;
    const back = robotTurn(this.side, wristTurn).invert();
    for (const { tip, chain } of FINGERS) {
      const at = positions[tip];
      if (!at) continue;
      this.reach(chain, new Vector3().fromArray(at).sub(new Vector3().fromArray(wrist)).applyQuaternion(back).multiplyScalar(SCALE));
    }
    const share = 1 - Math.exp(-passedS / LOW_PASS_S);
    this.angles = this.angles.map((before, joint) => before + share * (this.sought[joint] - before));
  }

  /**
   * Turns the joints of one finger towards a tip at `goal`, in the frame of the wrist.
   * @param {number[]} chain
   * @param {Vector3} goal
   */
  reach(chain, goal) {
    for (let step = 0; step < STEPS; step += 1) {
      const tip = this.tip(chain);
      const missing = goal.clone().sub(tip);
      const columns = chain.map((joint) => {
        this.sought[joint] += DIFFERENCE_RAD;
        const column = this.tip(chain).sub(tip).divideScalar(DIFFERENCE_RAD);
        this.sought[joint] -= DIFFERENCE_RAD;
        return column;
      });
      const normal = columns.map((one, row) => columns.map((other, column) => one.dot(other) + (row === column ? DAMPING_M2 : 0)));
      const change = solve(normal, columns.map((column) => column.dot(missing)));
      chain.forEach((joint, place) => {
        const [low, high] = this.joints[joint].range;
        this.sought[joint] = Math.max(low, Math.min(high, this.sought[joint] + change[place]));
      });
    }
  }

  /**
   * Returns the place of a fingertip in the frame of the wrist. The last link is as long as the one before.
   * @param {number[]} chain
   */
  tip(chain) {
    const at = new Vector3();
    const turn = new Quaternion();
    for (const joint of chain) {
      const { at: offset, turn: rest, axis } = this.joints[joint];
      at.add(offset.clone().applyQuaternion(turn));
      turn.multiply(rest).multiply(new Quaternion().setFromAxisAngle(axis, this.sought[joint]));
    }
    return at.add(this.joints[chain[chain.length - 1]].at.clone().applyQuaternion(turn));
  }
}

/** Returns the turn to a frame with these axes. @param {number[]} x @param {number[]} y @param {number[]} z */
function turnOf(x, y, z) {
  const [i, j, k] = [x, y, z].map((axis) => new Vector3().fromArray(axis));
  return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(i, j, k));
}

/**
 * Solves a small positive definite system by elimination.
 * @param {number[][]} matrix
 * @param {number[]} right
 */
function solve(matrix, right) {
  const rows = matrix.map((row, index) => [...row, right[index]]);
  const size = rows.length;
  for (let pivot = 0; pivot < size; pivot += 1) {
    for (let row = pivot + 1; row < size; row += 1) {
      const share = rows[row][pivot] / rows[pivot][pivot];
      rows[row] = rows[row].map((value, column) => value - share * rows[pivot][column]);
    }
  }
  const found = Array(size).fill(0);
  for (let row = size - 1; row >= 0; row -= 1) {
    const known = found.reduce((sum, value, column) => sum + value * rows[row][column], 0);
    found[row] = (rows[row][size] - known) / rows[row][row];
  }
  return found;
}
