// A person in a headset, by WebXR, who stands in the robot's place, sees the scene from its head in stereo, and moves its wrists by
// controllers or by their own hands. The readings of a side have the names of Unitree's televuer, such as `ctrl_squeeze` and `hand_pos`
// for its `left_ctrl_squeeze` and `left_hand_pos`.

import { Matrix4, Quaternion, Vector3 } from "three";
import { SIDES, bySide } from "../../src/message.js";
import { Board } from "./board.js";
import { Fingers, robotTurn } from "./fingers.js";

const STICK_DEAD = 0.15;
/** televuer's values of a trigger range from 10, released, to 0, fully pressed. */
const TRIGGER_LET_GO = 10;
/** Numbers of the buttons of a controller in WebXR's `xr-standard` mapping. */
const [TRIGGER, SQUEEZE, A, B] = [0, 1, 4, 5];
/** Minimum time between two pictures that counts as a pause. */
const MOST_PASSED_S = 0.1;

const dead = (/** @type {number | undefined} */ value) => (Math.abs(value ?? 0) < STICK_DEAD ? 0 : value ?? 0);

/** @typedef {import("../../src/message.js").Side} Side */
/** @typedef {import("../hands.js").Pose} Pose */
/**
 * Readings of one side: places of a hand's joints, or a controller.
 * @typedef {{
 *   hand_pos?: (number[] | null)[], ctrl_triggerValue?: number, ctrl_squeeze?: boolean, ctrl_thumbstickValue?: [number, number],
 *   ctrl_aButton?: boolean, ctrl_bButton?: boolean,
 * }} Read
 */

/**
 * Returns the pose of a joint that is seen.
 * @param {XRFrame} frame
 * @param {XRJointSpace | undefined} joint
 * @param {XRSpace} space
 */
const jointPose = (frame, joint, space) => (joint ? frame.getJointPose?.(joint, space) : undefined);

/** Axes of WebXR (x right, y up, z back) in those of a pelvis (x ahead, y left, z up). */
const PELVIS_AXES = new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(0, 0, 1), new Vector3(-1, 0, 0)));

/**
 * Returns a pose of the headset's space with the axes of the robot's pelvis. It is not that of a hand of somebody who sits in the robot's head:
 * a robot that leans to reach further would take the hand along, and so lean on.
 * @param {XRPose | undefined} pose
 * @returns {Pose | null}
 */
function inPelvis(pose) {
  if (!pose) return null;
  const { position: { x, y, z }, orientation } = pose.transform;
  const turn = new Quaternion(orientation.x, orientation.y, orientation.z, orientation.w).premultiply(PELVIS_AXES);
  return { position: new Vector3(x, y, z).applyQuaternion(PELVIS_AXES), turn };
}

/** The headset of one wearer. */
export class Headset {
  /** @type {XRSession | null} */
  session = null;
  /** Latest readings. @type {Record<Side, Read>} */
  data = { left: {}, right: {} };
  /**
   * Poses of a wearer's hand and of the robot's wrist at the moment when the hand began to move the wrist.
   * @type {Record<Side, { from: Pose, hand: Pose } | null>}
   */
  held = { left: null, right: null };
  /** @type {Board | null} */
  board = null;

  /** @param {import("../../src/stage/stage.js").Stage} stage @param {import("../hands.js").Hands} hands */
  constructor(stage, hands) {
    this.stage = stage;
    this.hands = hands;
    const joints = stage.head.robots[hands.robot].fingers;
    this.fingers = bySide((side, index) => new Fingers(side, joints[index]));
  }

  /** Returns true if this browser has a headset. */
  static async supported() {
    return (await navigator.xr?.isSessionSupported("immersive-vr").catch(() => false)) ?? false;
  }

  /**
   * Draws into the headset until its wearer leaves. `drawn` is called before every picture, and returns
   * lines for the wearer.
   * @param {() => string[]} drawn
   */
  async enter(drawn) {
    if (!navigator.xr) return;
    const session = await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["hand-tracking"] });
    const { renderer } = this.stage;
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local");
    await renderer.xr.setSession(session);
    this.session = session;
    const left = new Promise((done) => { session.addEventListener("end", done); });
    this.stage.ride(this.hands.robot);
    const board = this.board ?? new Board(this.stage.rig, this.stage.isLitByFile);
    this.board = board;
    let last = performance.now();
    renderer.setAnimationLoop((now, frame) => {
      board.say(drawn());
      const space = renderer.xr.getReferenceSpace();
      if (frame && space) this.read(session, frame, space, Math.min((now - last) / 1000, MOST_PASSED_S));
      last = now;
      this.stage.drawHeadset();
    });
    await left;
    renderer.setAnimationLoop(null);
    renderer.xr.enabled = false;
    this.session = null;
    this.data = { left: {}, right: {} };
    this.held = { left: null, right: null };
    this.stage.ride(null);
  }

  /** Ends the wearer's session. */
  leave() {
    this.session?.end();
  }

  /**
   * Reads the poses of controllers and hands.
   * @param {XRSession} session
   * @param {XRFrame} frame
   * @param {XRReferenceSpace} space
   * @param {number} passedS
   */
  read(session, frame, space, passedS) {
    this.data = { left: {}, right: {} };
    /** @type {Partial<Record<Side, Pose | null>>} */
    const poses = {};
    for (const source of session.inputSources) {
      const side = source.handedness;
      if (side === "none") continue;
      const own = this.data[side];
      if (source.hand) {
        const wrist = jointPose(frame, source.hand.get("wrist"), space);
        if (!wrist) continue;
        const { x, y, z, w } = wrist.transform.orientation;
        const places = [...source.hand.values()].map((joint) => jointPose(frame, joint, space)?.transform.position);
        own.hand_pos = places.map((at) => (at ? [at.x, at.y, at.z] : null));
        this.fingers[side].follow(own.hand_pos, new Quaternion(x, y, z, w), passedS);
        poses[side] = inPelvis(wrist);
      } else {
        poses[side] = inPelvis(frame.getPose(source.gripSpace ?? source.targetRaySpace, space));
        const { buttons = [], axes = [] } = source.gamepad ?? {};
        own.ctrl_triggerValue = TRIGGER_LET_GO * (1 - (buttons[TRIGGER]?.value ?? 0));
        own.ctrl_squeeze = (buttons[SQUEEZE]?.value ?? 0) > 0.5;
        own.ctrl_thumbstickValue = [dead(axes[2]), dead(axes[3])];
        own.ctrl_aButton = buttons[A]?.pressed ?? false;
        own.ctrl_bButton = buttons[B]?.pressed ?? false;
      }
    }
    // A visible hand always moves its wrist; a controller only while it is squeezed.
    for (const side of SIDES) {
      const seen = Boolean(this.data[side].hand_pos);
      this.follow(side, poses[side], seen || this.data[side].ctrl_squeeze, seen);
    }
  }

  /**
   * Moves a wrist of the robot with the wearer's while the wearer holds it. After a release it stays, so that the wearer's arm can
   * return. A controller turns it by its own rotation; a visible hand gives it the hand's orientation.
   * @param {Side} side
   * @param {Pose | null | undefined} pose
   * @param {boolean | undefined} meant
   * @param {boolean} seen
   */
  follow(side, pose, meant, seen) {
    if (!pose || !meant) {
      this.held[side] = null;
      return;
    }
    const { position, turn } = pose;
    const held = this.held[side] ?? { from: pose, hand: this.hands.pose(side) };
    this.held[side] = held;
    const { from, hand } = held;
    const turned = seen ? robotTurn(side, turn) : turn.clone().multiply(from.turn.clone().invert()).multiply(hand.turn);
    this.hands.place(side, position.clone().sub(from.position).add(hand.position), turned);
  }

  /**
   * Returns the requests of sticks, buttons and triggers, like those of keys and gamepads, and the fingers of visible
   * hands.
   */
  wanted() {
    const { data } = this;
    const [left, right] = SIDES.map((side) => data[side].ctrl_thumbstickValue ?? [0, 0]);
    const pressed = (/** @type {"ctrl_aButton" | "ctrl_bButton"} */ button) => Number(SIDES.some((side) => data[side][button]));
    /** @type {import("../inputs.js").Triggers} */
    const triggers = {};
    /** @type {Partial<Record<Side, number[]>>} */
    const fingers = {};
    for (const side of SIDES) {
      const value = data[side].ctrl_triggerValue;
      if (value !== undefined) triggers[side] = 1 - value / TRIGGER_LET_GO;
      if (data[side].hand_pos) fingers[side] = this.fingers[side].angles;
    }
    return { base: [-left[1], -left[0], -right[0]], height: pressed("ctrl_bButton") - pressed("ctrl_aButton"), triggers, fingers };
  }
}
