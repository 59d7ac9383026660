// Tracked hands as the fingers of a Dex3-1: `npm test`.
import assert from "node:assert/strict";
import { test } from "node:test";
import { Quaternion, Vector3 } from "three";
import { Fingers, robotTurn } from "../operators/headset/fingers.js";
import { SIDES } from "../src/message.js";

const SCALE = 1.15;
const CHAINS = [[0, 1, 2], [3, 4], [5, 6]];
const TIPS = [4, 14, 9];

/** @returns {import("../src/message.js").FingerJoint} */
const joint = (at, axis, low, high) => ({ pose: [...at, 0, 0, 0, 1], axis, range_rad: [low, high] });
/** The right hand, in the form of the server's messages, of `sim/assets/robots/g1_dex3/robot.xml`. */
const RIGHT = [
  joint([0.067, -0.003, 0], [0, 1, 0], -1.0472, 1.0472),
  joint([-0.0025, 0.0193, 0], [0, 0, 1], -1.0472, 0.7243),
  joint([0, 0.0458, 0], [0, 0, 1], -1.7453, 0),
  joint([0.1192, -0.0046, -0.0285], [0, 0, 1], 0, 1.5708),
  joint([0.0458, 0, 0], [0, 0, 1], 0, 1.7453),
  joint([0.1192, -0.0046, 0.0285], [0, 0, 1], 0, 1.5708),
  joint([0.0458, 0, 0], [0, 0, 1], 0, 1.7453),
];
/** The left hand, which mirrors the right one. */
const LEFT = RIGHT.map(({ pose: [x, y, z], axis: [i, j, k], range_rad: [low, high] }) =>
  (j === 1 ? joint([x, -y, z], [i, j, k], low, high) : joint([x, -y, z], [i, j, k], -high, -low)));
const HANDS = { left: LEFT, right: RIGHT };

/** Returns a person's hand with the fingertips of a robot's hand at these joint angles, relative to a wrist with any pose. */
function personWith(side, angles, wrist, turn) {
  const robot = new Fingers(side, HANDS[side]);
  robot.sought = [...angles];
  const positions = Array(25).fill(null);
  positions[0] = wrist.toArray();
  CHAINS.forEach((chain, finger) => {
    const way = robot.tip(chain).divideScalar(SCALE).applyQuaternion(robotTurn(side, turn));
    positions[TIPS[finger]] = way.add(wrist).toArray();
  });
  return positions;
}

const somewhere = new Vector3(0.2, 1.1, -0.4);
const turned = new Quaternion(0.3, -0.5, 0.2, 0.7).normalize();
const grasp = { right: [0.2, -0.5, -0.6, 0.8, 0.9, 0.6, 0.7], left: [0.2, 0.5, 0.6, -0.8, -0.9, -0.6, -0.7] };

for (const side of SIDES) {
  test(`a ${side} hand whose tips are those of a Dex3 is followed to its joints`, () => {
    const fingers = new Fingers(side, HANDS[side]);
    const positions = personWith(side, grasp[side], somewhere, turned);
    for (let frame = 0; frame < 90; frame += 1) fingers.follow(positions, turned, 1 / 30);
    fingers.angles.forEach((angle, index) => assert.ok(Math.abs(angle - grasp[side][index]) < 0.01, `${index}: ${angle}`));
  });

  test(`a ${side} hand that cannot be reached stays within the joints' limits`, () => {
    const fingers = new Fingers(side, HANDS[side]);
    const positions = Array.from({ length: 25 }, (_, index) => [Math.sin(index), 1 + Math.cos(3 * index), -0.5]);
    for (let frame = 0; frame < 200; frame += 1) {
      fingers.follow(positions, turned, 1 / 72);
      fingers.angles.forEach((angle, index) => {
        const [low, high] = HANDS[side][index].range_rad;
        assert.ok(angle >= low - 1e-12 && angle <= high + 1e-12, `${index}: ${angle}`);
      });
    }
  });
}

test("a step of the hand is followed to 63 % in 0.15 s, however often is drawn", () => {
  for (const rate of [15, 30, 90]) {
    const fingers = new Fingers("right", RIGHT);
    const positions = personWith("right", grasp.right, somewhere, turned);
    // The solution is found immediately; the command follows with a delay.
    for (let frame = 0; frame < 20; frame += 1) fingers.follow(positions, turned, 0);
    assert.ok(fingers.angles.every((angle) => angle === 0), "no time has passed");
    for (let frame = 0; frame < Math.round(0.15 * rate); frame += 1) fingers.follow(positions, turned, 0.15 / Math.round(0.15 * rate));
    fingers.angles.forEach((angle, index) => assert.ok(Math.abs(angle / grasp.right[index] - 0.634) < 0.02, `${rate}: ${angle}`));
  }
});

test("a finger that is not seen stays, and a hand without a wrist, too", () => {
  const fingers = new Fingers("right", RIGHT);
  const positions = personWith("right", grasp.right, somewhere, turned);
  positions[TIPS[1]] = null;
  for (let frame = 0; frame < 60; frame += 1) fingers.follow(positions, turned, 1 / 30);
  assert.ok(fingers.angles[3] === 0 && fingers.angles[4] === 0 && fingers.angles[5] > 0.5);
  const before = [...fingers.angles];
  fingers.follow(Array(25).fill(null), turned, 1);
  assert.deepEqual(fingers.angles, before);
});

test("palms down and fingers ahead, wrists of both kinds agree", () => {
  // A headset's axes are x right, y up, z back; a robot's wrist has x ahead and z to the index finger, that is, inwards.
  const axes = (side) => ["x", "y", "z"].map((axis) => {
    const way = new Vector3();
    way[axis] = 1;
    return way.applyQuaternion(robotTurn(side, new Quaternion())).toArray().map((value) => Math.round(value) + 0);
  });
  assert.deepEqual(axes("left"), [[0, 0, -1], [0, 1, 0], [1, 0, 0]]);
  assert.deepEqual(axes("right"), [[0, 0, -1], [0, -1, 0], [-1, 0, 0]]);
});
