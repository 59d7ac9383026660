// A person in a headset, by WebXR: stands in the robot's place, sees the scene from its head in stereo, and moves its wrists by
// controllers or by their own hands. What is read has the names of Unitree's televuer: `left_ctrl_squeeze`, `right_hand_pos` and so on.

import { Matrix4, Quaternion, Vector3 } from "three";
import { SIDES } from "../../src/message.js";
import { Board } from "./board.js";
import { Fingers, robotTurn } from "./fingers.js";

const STICK_DEAD = 0.15;
/** televuer's values of a trigger go from 10, let go, to 0, fully pressed. */
const TRIGGER_LET_GO = 10;
/** Where a controller of WebXR's `xr-standard` mapping has its buttons. */
const [TRIGGER, SQUEEZE, A, B] = [0, 1, 4, 5];
/** A longer time between two pictures was a pause. */
const MOST_PASSED_S = 0.1;

const dead = (value) => (Math.abs(value ?? 0) < STICK_DEAD ? 0 : value);

/** Axes of WebXR (x right, y up, z back) in those of a pelvis (x ahead, y left, z up). */
const PELVIS_AXES = new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(new Vector3(0, -1, 0), new Vector3(0, 0, 1), new Vector3(-1, 0, 0)));

/**
 * A pose of the headset's space with the axes of the robot's pelvis. It is not that of a hand of somebody who sits in the robot's head:
 * a robot that leans to reach further would take the hand along, and so lean on.
 */
function inPelvis(pose) {
  if (!pose) return null;
  const { position: { x, y, z }, orientation } = pose.transform;
  const turn = new Quaternion(orientation.x, orientation.y, orientation.z, orientation.w).premultiply(PELVIS_AXES);
  return { position: new Vector3(x, y, z).applyQuaternion(PELVIS_AXES), turn };
}

export class Headset {
  /** @param {import("../../src/stage.js").Stage} stage @param {import("../hands.js").Hands} hands */
  constructor(stage, hands) {
    Object.assign(this, { stage, hands, session: null, data: {}, held: {} });
    const joints = stage.head.robots[hands.robot].fingers;
    this.fingers = Object.fromEntries(SIDES.map((side, index) => [side, new Fingers(side, joints[index])]));
  }

  static supported() {
    return navigator.xr?.isSessionSupported("immersive-vr").catch(() => false) ?? Promise.resolve(false);
  }

  /** Draws into the headset until its wearer leaves. `drawn` is called before every picture, and answers with lines for the wearer. */
  async enter(drawn) {
    const session = await navigator.xr.requestSession("immersive-vr", { optionalFeatures: ["hand-tracking"] });
    const { renderer } = this.stage;
    renderer.xr.enabled = true;
    renderer.xr.setReferenceSpaceType("local");
    await renderer.xr.setSession(session);
    this.session = session;
    const left = new Promise((done) => { session.addEventListener("end", done); });
    this.stage.ride(this.hands.robot);
    this.board ??= new Board(this.stage.rig);
    let last = performance.now();
    renderer.setAnimationLoop((now, frame) => {
      this.board.say(drawn());
      if (frame) this.read(frame, renderer.xr.getReferenceSpace(), Math.min((now - last) / 1000, MOST_PASSED_S));
      last = now;
      this.stage.drawHeadset();
    });
    await left;
    renderer.setAnimationLoop(null);
    renderer.xr.enabled = false;
    Object.assign(this, { session: null, data: {}, held: {} });
    this.stage.ride(null);
  }

  /** Takes the wearer out of it. */
  leave() {
    this.session?.end();
  }

  /** Takes in where controllers and hands are. */
  read(frame, space, passedS) {
    const data = {};
    const poses = {};
    for (const source of this.session.inputSources) {
      const side = source.handedness;
      if (!SIDES.includes(side)) continue;
      if (source.hand) {
        const wrist = frame.getJointPose(source.hand.get("wrist"), space);
        if (!wrist) continue;
        const { x, y, z, w } = wrist.transform.orientation;
        const places = [...source.hand.values()].map((joint) => frame.getJointPose(joint, space)?.transform.position);
        data[`${side}_hand_pos`] = places.map((at) => at && [at.x, at.y, at.z]);
        this.fingers[side].follow(data[`${side}_hand_pos`], new Quaternion(x, y, z, w), passedS);
        poses[side] = inPelvis(wrist);
      } else {
        poses[side] = inPelvis(frame.getPose(source.gripSpace ?? source.targetRaySpace, space));
        const { buttons = [], axes = [] } = source.gamepad ?? {};
        data[`${side}_ctrl_triggerValue`] = TRIGGER_LET_GO * (1 - (buttons[TRIGGER]?.value ?? 0));
        data[`${side}_ctrl_squeeze`] = (buttons[SQUEEZE]?.value ?? 0) > 0.5;
        data[`${side}_ctrl_thumbstickValue`] = [dead(axes[2]), dead(axes[3])];
        data[`${side}_ctrl_aButton`] = buttons[A]?.pressed ?? false;
        data[`${side}_ctrl_bButton`] = buttons[B]?.pressed ?? false;
      }
    }
    this.data = data;
    // A hand that is seen is meant; a controller is while it is squeezed.
    for (const side of SIDES) {
      const seen = Boolean(data[`${side}_hand_pos`]);
      this.follow(side, poses[side], seen || data[`${side}_ctrl_squeeze`], seen);
    }
  }


  /**
   * While it is meant, a wrist of the robot goes as the wearer's does; let go, it stays: so the wearer's arm can come back. A
   * controller turns it by as much as it turns itself; a hand that is seen turns it as it is turned.
   */
  follow(side, pose, meant, seen) {
    if (!pose || !meant) {
      this.held[side] = null;
      return;
    }
    const { position, turn } = pose;
    this.held[side] ??= { from: pose, hand: this.hands.pose(side) };
    const { from, hand } = this.held[side];
    const turned = seen ? robotTurn(side, turn) : turn.clone().multiply(from.turn.clone().invert()).multiply(hand.turn);
    this.hands.place(side, position.clone().sub(from.position).add(hand.position), turned);
  }

  /** What sticks, buttons and triggers ask for, as keys and gamepads do, and the fingers of hands that are seen. */
  wanted() {
    const { data } = this;
    const [left, right] = SIDES.map((side) => data[`${side}_ctrl_thumbstickValue`] ?? [0, 0]);
    const pressed = (button) => Number(SIDES.some((side) => data[`${side}_ctrl_${button}`]));
    const triggers = {};
    const fingers = {};
    for (const side of SIDES) {
      const value = data[`${side}_ctrl_triggerValue`];
      if (value !== undefined) triggers[side] = 1 - value / TRIGGER_LET_GO;
      if (data[`${side}_hand_pos`]) fingers[side] = this.fingers[side].angles;
    }
    return { base: [-left[1], -left[0], -right[0]], height: pressed("bButton") - pressed("aButton"), triggers, fingers };
  }
}
