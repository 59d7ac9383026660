// A person's requests to the robot, from keys, buttons and a gamepad.

/** @typedef {import("../src/message.js").Side} Side */
/** @typedef {Partial<Record<Side, number>>} Triggers Shares by which the fingers of hands are closed. */
/**
 * Requests of a person: velocities of base, selected wrist and height, fingers by share or by joint, and true in `clutch` for resting arms.
 * @typedef {{
 *   vx_m_s: number, vy_m_s: number, yaw_rate_rad_s: number, wristM_s: number[], wristRad_s: number[], heightM_s: number,
 *   triggers: Triggers, fingers?: Partial<Record<Side, number[]>>, clutch: boolean,
 * }} Wanted
 */

/** Joint angles of the fingers of open hands, in radians. */
export const OPEN = { left: [0, -0.3, 0, 0, 0, 0, 0], right: [0, 0.3, 0, 0, 0, 0, 0] };
/** Joint angles of the fingers of closed hands, in radians. */
export const CLOSED = { left: [0, 0.75, 0.8, -1.1, -1.3, -1.1, -1.3], right: [0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3] };
const WALK_M_S = 0.3;
const TURN_RAD_S = 0.5;
const WRIST_M_S = 0.2;
const WRIST_RAD_S = 0.8;
const HEIGHT_M_S = 0.1;
const STICK_DEAD = 0.15;

const BASE_KEYS = { w: [1, 0, 0], s: [-1, 0, 0], a: [0, 1, 0], d: [0, -1, 0], q: [0, 0, 1], e: [0, 0, -1] };
const WRIST_KEYS = {
  ArrowUp: [1, 0, 0], ArrowDown: [-1, 0, 0], ArrowLeft: [0, 1, 0], ArrowRight: [0, -1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1],
};
/**
 * Axes of the pelvis frame about which a hand turns: fingers up and down, to the left and right, and about their
 * own axis.
 */
const ROTATION_KEYS = { i: [0, -1, 0], k: [0, 1, 0], j: [0, 0, 1], l: [0, 0, -1], u: [-1, 0, 0], m: [1, 0, 0] };
/** @type {Record<string, number>} */
const HEIGHT_KEYS = { r: 1, f: -1 };

const within = (/** @type {Event} */ event, /** @type {string} */ what) => event.target instanceof Element && Boolean(event.target.closest(what));
/**
 * Returns true if a key is for the element with the focus. Texts and lists take all keys, buttons and boxes those that
 * press them.
 */
const taken = (/** @type {KeyboardEvent} */ event) => within(event, "input:not([type=checkbox]), select, textarea") || ([" ", "Enter"].includes(event.key) && within(event, "button, input, a"));
const nameOf = (/** @type {KeyboardEvent} */ event) => (event.key.length === 1 ? event.key.toLowerCase() : event.key);
/**
 * Sums the vectors of the held keys in a table.
 * @param {Set<string>} keys
 * @param {Record<string, number[]>} table
 */
const sum = (keys, table) =>
  [...keys].map((key) => table[key]).filter(Boolean).reduce((total, one) => total.map((value, axis) => value + one[axis]), [0, 0, 0]);

/**
 * Listens to keys until `signal` aborts. `pressed(key)` is called for keys that act once, and returns true if it has used the key.
 * Returns the held keys.
 * @param {(key: string) => boolean} pressed
 * @param {AbortSignal} signal
 */
export function listen(pressed, signal) {
  /** @type {Set<string>} */
  const keys = new Set();
  addEventListener("keydown", (event) => {
    if (taken(event) || event.ctrlKey || event.metaKey || event.altKey) return;
    const key = nameOf(event);
    const held = key in BASE_KEYS || key in WRIST_KEYS || key in ROTATION_KEYS || key in HEIGHT_KEYS;
    if (held) event.preventDefault();
    if (held) keys.add(key);
    else if (!event.repeat && pressed(key)) event.preventDefault();
  }, { signal });
  addEventListener("keyup", (event) => keys.delete(nameOf(event)), { signal });
  addEventListener("blur", () => keys.clear(), { signal });
  return keys;
}

const stick = (/** @type {number | undefined} */ value) => (Math.abs(value ?? 0) < STICK_DEAD ? 0 : value ?? 0);

/**
 * Reads the first gamepad: two sticks for the base, triggers for the fingers, either bumper for the clutch.
 * @returns {{ base: number[], triggers: Triggers, clutch: boolean }}
 */
function gamepad() {
  const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
  if (!pad) return { base: [0, 0, 0], triggers: {}, clutch: false };
  const [x, y, turn] = [0, 1, 2].map((axis) => stick(pad.axes[axis]));
  const [leftBumper, rightBumper, left, right] = [4, 5, 6, 7].map((index) => pad.buttons[index]?.value ?? 0);
  return { base: [-y, -x, -turn], triggers: { left, right }, clutch: leftBumper + rightBumper > 0.5 };
}

/**
 * Reads the present requests of keys, gamepad and the pads for thumbs.
 * @param {Set<string>} keys
 * @param {{ base: number[], height: number }} thumbs
 * @returns {Wanted}
 */
export function wanted(keys, thumbs) {
  const pad = gamepad();
  const most = (/** @type {number} */ value) => Math.max(-1, Math.min(1, value));
  const base = sum(keys, BASE_KEYS).map((value, axis) => most(value + pad.base[axis] + thumbs.base[axis]));
  return {
    vx_m_s: base[0] * WALK_M_S,
    vy_m_s: base[1] * WALK_M_S,
    yaw_rate_rad_s: base[2] * TURN_RAD_S,
    wristM_s: sum(keys, WRIST_KEYS).map((value) => value * WRIST_M_S),
    wristRad_s: sum(keys, ROTATION_KEYS).map((value) => value * WRIST_RAD_S),
    heightM_s: HEIGHT_M_S * [...keys].reduce((total, key) => total + (HEIGHT_KEYS[key] ?? 0), thumbs.height),
    triggers: pad.triggers,
    clutch: pad.clutch,
  };
}

/**
 * Adds the requests of a headset's controllers.
 * @param {Wanted} want
 * @param {ReturnType<import("./headset/headset.js").Headset["wanted"]>} worn
 * @returns {Wanted}
 */
export function withHeadset(want, { base, height, triggers, fingers }) {
  const [ahead, left, turn] = base;
  return {
    ...want,
    vx_m_s: want.vx_m_s + ahead * WALK_M_S,
    vy_m_s: want.vy_m_s + left * WALK_M_S,
    yaw_rate_rad_s: want.yaw_rate_rad_s + turn * TURN_RAD_S,
    heightM_s: want.heightM_s + height * HEIGHT_M_S,
    triggers: { ...want.triggers, ...triggers },
    fingers,
  };
}

/**
 * Returns the joint angles of the fingers of `hand` at a share of closure.
 * @param {Side} hand
 * @param {number} share
 */
export const closedBy = (hand, share) => OPEN[hand].map((open, joint) => open + share * (CLOSED[hand][joint] - open));
