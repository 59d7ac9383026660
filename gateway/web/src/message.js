// Messages of the server: scenes with their shapes, and steps as rows of numbers. `episodes/src/live/frame.rs` describes a row.

/** @typedef {"left" | "right"} Side */
/** @typedef {{ number: string, id: string, collaborative: boolean }} Phase */
/** @typedef {{ number: string, time_s: number }} PhaseReached */
/** @typedef {{ vertical_fov_rad: number, width: number, height: number }} CameraHead */
/** A joint of a finger: its pose in the frame of the link before it, and its axis there. */
/** @typedef {{ pose: number[], axis: number[], range_rad: [number, number] }} FingerJoint */
/**
 * @typedef {{ name: string, links: number, joints: string[], fingers: FingerJoint[][], camera: CameraHead }} RobotHead
 */
/** The body that carries a shape. */
/**
 * @typedef {{ kind: "room" } | { kind: "link", robot: number, link: number } | { kind: "object", object: number }} Carrier
 */
/** Emission and highlights of a surface. A surface without gloss in its file has no such fields. */
/**
 * @typedef {{ emission: number, specular: number, shininess: number, roughness: number | null, metallic: number }} Gloss
 */
/**
 * Mapping from the points of a mesh to an image: by the mesh's own coordinates, along its z, or from the middle of a cube.
 * @typedef {{ kind: "corners" }
 *   | { kind: "along", scale_1_m: [number, number], centre_m: [number, number] }
 *   | { kind: "cube", scale_1_m: number[], centre_m: number[] }} Mapping
 */
/** Image on a surface, with the images of its gloss, its relief and its emitted light at the same places, as indices of `textures`. */
/** @typedef {{ texture: number, gloss: number | null, relief: number | null, emitted: number | null, mapping: Mapping }} SurfaceImage */
/**
 * @typedef {{
 *   mesh: number, carrier: Carrier, pose: number[], rgb: Rgb, alpha: number, casts_shadow: boolean,
 *   gloss?: Gloss, image?: SurfaceImage,
 * }} Shape
 */
/** @typedef {Shape & { pattern: "checker", second_rgb: Rgb }} CheckedPart */
/**
 * A shape of the scene.
 * @typedef {CheckedPart | Shape & { pattern: "plain" | "wood" | "fabric" | "print", second_rgb: null }} Part
 */
/** @typedef {[number, number, number]} Rgb */
/** @typedef {{ positions: Float32Array, indices: Uint32Array, normals: Int8Array, uvs: Float32Array | null }} Mesh */
/** Image that a page requests by its hash, or the six images of a cube. */
/** @typedef {{ hash: string, images: number, mean_rgb: Rgb, has_alpha: boolean }} TextureHead */
/**
 * Light of a scene's file. Its colours multiply the file's values directly, without a conversion to linear light.
 * @typedef {{
 *   kind: "directional" | "spot" | "point", carrier: Carrier, position_m: number[], direction: number[],
 *   ambient: Rgb, diffuse: Rgb, specular: Rgb, attenuation: [number, number, number],
 *   cutoff_rad: number, exponent: number, casts_shadow: boolean,
 * }} Lamp
 */
/** @typedef {{ headlight: { ambient: Rgb, diffuse: Rgb, specular: Rgb }, lamps: Lamp[] }} Lights */

/**
 * Header of a scene, which `episodes/src/live/scene.rs` writes. `robot` is the robot that the page drives, if there is one.
 * @typedef {{
 *   task: string, seed: number, protocol: string, instruction: string, assistance: string,
 *   episode_steps: number, thinking_s: number | null, phases: Phase[], robots: RobotHead[], objects: string[],
 *   third_person: { pose: number[], vertical_fov_rad: number },
 *   meshes: [number, number, number?][], parts: Part[], textures: TextureHead[], sky: number | null, lights: Lights | null,
 *   frames: number, robot?: string,
 * }} SceneHead
 */
/**
 * Result of an episode.
 * @typedef {{
 *   task: string, seed: number, protocol: string, ended: string, phases?: Record<string, number | null>,
 *   env_steps: number, tool_calls: number, falls: number,
 *   usage?: { endings?: { robot?: string | null, ending: string }[] } | null,
 * }} Result
 */
/**
 * A call of an episode, with its arguments and its reply in JSON. `number` is null for a call that does not count.
 * @typedef {{
 *   kind: "call", entry: number, number: number | null, time_s: number, thought_s: number, tool: string,
 *   arguments: string, operator: string | null, ok: boolean, reply: string, seen: string[], note?: undefined,
 * }} CallEntry
 */
/**
 * Note of a policy. `episodes/src/recording/topics/notes.rs` describes its fields.
 * @typedef {{
 *   text: string, kind: string, robot?: string, model?: string,
 *   input_tokens?: number, output_tokens?: number, cached_tokens?: number, usd?: number, seconds?: number,
 * }} Note
 */
/**
 * @typedef {{
 *   kind: "note", entry: number, time_s: number, thought_s: number, note: Note, number?: undefined, seen?: undefined,
 * }} NoteEntry
 */
/** @typedef {CallEntry | NoteEntry} Entry */
/** Header of a scene for watchers. */
/** @typedef {SceneHead & { story: Entry[], reached: PhaseReached[], result: Result | null }} WatchedHead */
/** @typedef {{ head: SceneHead, meshes: Mesh[], layout: Layout, frames: Frame[] }} Scene */
/** @typedef {Scene & { head: WatchedHead }} WatchedScene */

/** Numbers of a pose: x, y, z, and the quaternion x, y, z, w. */
export const POSE = 7;
const HEAD = 5;
const HAND = POSE + POSE + 1 + 2 + 3 + 3;
const BASE = 4;
/** @type {Side[]} */
export const SIDES = ["left", "right"];
export const HAND_STATES = ["joints", "moving", "arrived", "blocked", "out_of_reach"];

/**
 * Places of the numbers of a step in its row.
 * @typedef {{
 *   length: number,
 *   links: number[],
 *   objects: number,
 *   robots: { fallen: number, camera: number, base: number, hands: number[], efforts: number, joints: number }[],
 * }} Layout
 */

/**
 * Makes a value for each side.
 * @template Value
 * @param {(side: Side, index: number) => Value} make
 * @returns {Record<Side, Value>}
 */
export const bySide = (make) => ({ left: make("left", 0), right: make("right", 1) });

/** Returns the layout of the rows of a scene. @param {SceneHead} head @returns {Layout} */
export function layoutOf(head) {
  let at = HEAD;
  const take = (/** @type {number} */ numbers) => (at += numbers) - numbers;
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

/** A step, read from its row. */
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

  /** Returns true if a robot has fallen. @param {number} robot */
  fallen(robot) { return this.row[this.layout.robots[robot].fallen] > 0; }

  /**
   * Returns one hand of a robot: places of its poses in the row, and its numbers.
   * @param {number} robot
   * @param {number} side
   */
  hand(robot, side) {
    const at = this.layout.robots[robot].hands[side];
    const rest = at + 2 * POSE;
    const vector = (/** @type {number} */ place) => [this.row[place], this.row[place + 1], this.row[place + 2]];
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

  /**
   * Returns the largest share of an effort limit among joints of a robot.
   * @param {number} robot
   * @param {number[]} wanted
   */
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
 * @returns {Scene}
 */
export function readScene(message) {
  const size = new DataView(message).getUint32(0, true);
  /** @type {SceneHead} */
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(message, 4, size)));
  let at = 4 + size;
  const meshes = head.meshes.map(([vertices, triangles, hasUvs]) => {
    const positions = new Float32Array(message, at, 3 * vertices);
    at += 12 * vertices;
    const indices = new Uint32Array(message, at, 3 * triangles);
    at += 12 * triangles;
    const normals = new Int8Array(message, at, 4 * vertices);
    at += 4 * vertices;
    const uvs = hasUvs ? new Float32Array(message, at, 2 * vertices) : null;
    if (uvs) at += 8 * vertices;
    return { positions, indices, normals, uvs };
  });
  const layout = layoutOf(head);
  const frames = [];
  for (let frame = 0; frame < head.frames; frame += 1, at += 4 * layout.length) {
    frames.push(new Frame(new Float32Array(message, at, layout.length), layout));
  }
  return { head, meshes, layout, frames };
}
