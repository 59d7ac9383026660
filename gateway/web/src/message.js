// What the server sends: scenes with their shapes, and steps as rows of numbers. `episodes/src/live/frame.rs` says what is in a row.

/** Numbers of a pose: x, y, z, and the quaternion x, y, z, w. */
export const POSE = 7;
const HEAD = 5;
const HAND = POSE + POSE + 1 + 2 + 3 + 3;
const BASE = 4;
export const SIDES = ["left", "right"];
export const HAND_STATES = ["joints", "moving", "arrived", "blocked", "out_of_reach"];

/**
 * Where the numbers of a step are.
 * @typedef {{
 *   length: number,
 *   links: number[],
 *   objects: number,
 *   robots: { fallen: number, camera: number, base: number, hands: number[], efforts: number, joints: number }[],
 * }} Layout
 */

/** @returns {Layout} */
export function layoutOf(head) {
  let at = HEAD;
  const take = (numbers) => (at += numbers) - numbers;
  const links = head.robots.map((robot) => take(robot.links * POSE));
  const objects = take(head.objects.length * POSE);
  const robots = head.robots.map((robot) => ({
    fallen: take(1),
    camera: take(POSE),
    base: take(BASE),
    hands: SIDES.map(() => take(HAND)),
    efforts: take(robot.joints.length),
    joints: robot.joints.length,
  }));
  return { links, objects, robots, length: at };
}

/** A step as its row says it. */
export class Frame {
  /** @param {Float32Array} row @param {Layout} layout */
  constructor(row, layout) {
    this.row = row;
    this.layout = layout;
  }

  get step() { return this.row[1]; }
  get time() { return this.row[2]; }
  get stepsLeft() { return this.row[3]; }
  get clockLeft() { return this.row[4]; }

  fallen(robot) { return this.row[this.layout.robots[robot].fallen] > 0; }

  /** One hand of a robot: places of its poses in the row, and its numbers. */
  hand(robot, side) {
    const at = this.layout.robots[robot].hands[side];
    const rest = at + 2 * POSE;
    const vector = (place) => [this.row[place], this.row[place + 1], this.row[place + 2]];
    return {
      wrist: at,
      target: at + POSE,
      state: HAND_STATES[this.row[rest]],
      positionError: this.row[rest + 1],
      orientationError: this.row[rest + 2],
      felt: vector(rest + 3),
      contact: vector(rest + 6),
    };
  }

  /** The largest share of an effort limit among the joints of a robot whose names begin so, or do with none of them. */
  effort(robot, wanted) {
    const { efforts } = this.layout.robots[robot];
    let most = 0;
    for (const joint of wanted) most = Math.max(most, this.row[efforts + joint]);
    return most;
  }
}

/**
 * Reads the message of a scene.
 * @param {ArrayBuffer} message
 */
export function readScene(message) {
  const size = new DataView(message).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, size)));
  let at = 4 + size;
  const meshes = head.meshes.map(([vertices, triangles]) => {
    const positions = new Float32Array(message, at, 3 * vertices);
    at += 12 * vertices;
    const indices = new Uint32Array(message, at, 3 * triangles);
    at += 12 * triangles;
    const normals = new Int8Array(message, at, 4 * vertices);
    at += 4 * vertices;
    return { positions, indices, normals };
  });
  const layout = layoutOf(head);
  const frames = [];
  for (let frame = 0; frame < head.frames; frame += 1, at += 4 * layout.length) {
    frames.push(new Frame(new Float32Array(message, at, layout.length), layout));
  }
  return { head, meshes, layout, frames };
}
