// One person drives one robot, in three dimensions. The page sends its setpoints 50 times a second. The server makes commands from them
// while everybody is present, so time is paused while a person's page is closed or out of view.

import { Vector3 } from "three";
import { reasonOf } from "../src/dom.js";
import { SIDES } from "../src/message.js";
import { Pace, Stage } from "../src/stage/stage.js";
import { bearer, call, statusOf } from "./call.js";
import { Hands } from "./hands.js";
import { Headset } from "./headset/headset.js";
import { CLOSED, OPEN, closedBy, listen, wanted, withHeadset } from "./inputs.js";
import { layOut, nothing } from "./panel.js";
import { Touch } from "./touch.js";
import { Wheel, tokensOf } from "./wheel.js";

const SAY_MS = 20;
const HEIGHT_RANGE_M = [0.5, 0.78];
/** Duration of a frame above which drawing is simplified: a hand's motion is visible two frames later. */
const SLOW_FRAME_MS = 40;
/** Number of control steps for a press of the step button. */
const STEPS = 10;
/** Maximum duration of a command that is being executed. */
const FINISH_AGAIN_MS = 300;
/** Share of the height that the robot's picture takes. The robot's hanging hands are below. */
const PICTURE_SHARE = 0.7;
/** Actions of the keys that act once. Enter acts only in the stepwise mode. @type {Record<string, string>} */
const KEYS = { 1: "left", 2: "right", o: "open", c: "close", h: "level", " ": "clutch", Enter: "step" };

/** @typedef {import("../src/message.js").Side} Side */
/** @typedef {import("./wheel.js").EpisodeSeat} EpisodeSeat */
/** @typedef {import("./wheel.js").Ended} Ended */
/**
 * Parts of the page that need the scene: the robot's hands, its partners, their drawing, and the newest step.
 * @typedef {{
 *   hands: Hands, partners: { name: string, index: number }[], stage: Stage, headset: Headset, frame: import("../src/message.js").Frame,
 * }} Cockpit
 */

/**
 * Shows the page of `seat` and drives until the episode has ended. Returns its result, and a function that frees the page's drawing
 * resources; null if there is no robot to drive.
 * @param {HTMLElement} main
 * @param {EpisodeSeat} seat
 */
export async function drive(main, seat) {
  const root = `/v1/episodes/${encodeURIComponent(seat.episode)}`;
  try {
    await call("/operate/enter", seat.token, {}, { credentials: "same-origin" });
  } catch (error) {
    nothing(main, statusOf(error) === 403 ? "This link drives no robot here." : reasonOf(error));
    return null;
  }
  const briefing = await call(`${root}/briefing`, seat.token).catch((error) => error);
  if (briefing instanceof Error) {
    nothing(main, briefing.message);
    return null;
  }
  return new DrivePage(main, seat, root, briefing).drive();
}

class DrivePage {
  /** The hand that keys and buttons are for. @type {Side} */
  hand = "right";
  /** Finger joints to command. @type {Partial<Record<Side, number[]>>} */
  fingers = {};
  /** Closure of the hands by triggers, as shares. @type {Partial<Record<Side, number>>} */
  shares = {};
  /** @type {number | null} */
  heightM = null;
  asksHeight = false;
  /** Reason why the person's own robot stands still. @type {string | null} */
  paused = null;
  /** Reason why time is paused because of others. @type {string | null} */
  waits = null;
  stepwise = false;
  steps = 0;
  finishing = false;
  /** Robots whose people have been absent for a long time. @type {Set<string>} */
  gone = new Set();
  over = new AbortController();
  left = false;
  touch = new Touch();
  pace = new Pace(SLOW_FRAME_MS);
  /** @type {Cockpit | null} */
  cockpit = null;
  /** True if a received step is not shown yet. */
  stale = false;
  /** Time of the last report. @type {number | null} */
  timeS = null;
  /** @type {(result: Ended) => void} */
  done = () => {};

  /**
   * @param {HTMLElement} main
   * @param {EpisodeSeat} seat
   * @param {string} root
   * @param {import("./panel.js").Briefing} briefing
   */
  constructor(main, seat, root, briefing) {
    this.seat = seat;
    this.root = root;
    this.panel = layOut(main, seat, briefing, this.touch.parts, {
      act: (action) => this.act(action),
      speak: (text) => call(`${root}/tools/say`, seat.token, { text }),
      finish: () => this.finish(),
      look: (view) => { this.cockpit?.stage.look(view === "robot" ? seat.robot : "free"); this.panel.border(view === "robot"); },
      wear: () => this.wear(),
      stepwise: (on) => { this.stepwise = on; this.label(); },
    });
    SIDES.forEach((side) => this.draggable(side));
    this.wheel = new Wheel(seat, {
      scene: (scene) => this.begin(scene),
      frame: (frame) => this.see(frame),
      told: (message) => this.told(message),
      lost: (why) => this.panel.status(why),
    });
    this.label();
    /** The keys that are held. */
    this.keys = listen((key) => {
      const action = key === "Enter" && !this.stepwise ? undefined : KEYS[key];
      if (action) this.act(action);
      return Boolean(action);
    }, this.over.signal);
  }

  /** Drives until the episode is over. The final state remains visible. */
  async drive() {
    this.wheel.connect();
    let said = performance.now();
    const saying = setInterval(() => {
      const now = performance.now();
      this.say(Math.min(now - said, 100) / 1000);
      said = now;
    }, SAY_MS);
    document.addEventListener("visibilitychange", () => this.say(0), { signal: this.over.signal });
    requestAnimationFrame((now) => this.draw(now, now));
    /** @type {Ended} */
    const result = await new Promise((done) => { this.done = done; });
    clearInterval(saying);
    this.over.abort();
    this.wheel.close();
    const leave = () => {
      this.left = true;
      this.cockpit?.headset.leave();
      this.cockpit?.stage.leave();
    };
    return { result, leave };
  }

  /**
   * Receives the scene, for the first time or after the connection was lost.
   * @param {import("../src/message.js").Scene} scene
   */
  begin(scene) {
    if (this.cockpit) return;
    const robot = scene.head.robots.findIndex(({ name }) => name === this.seat.robot);
    const hands = new Hands(robot);
    const partners = scene.head.robots.map(({ name }, index) => ({ name, index })).filter(({ index }) => index !== robot);
    const stage = new Stage(this.panel.view, scene, (hash) =>
      fetch(`/operate/texture?hash=${hash}`, { headers: bearer(this.seat.token), credentials: "omit" }));
    stage.pictureShare = PICTURE_SHARE;
    // The partners' cameras are not useful to this person.
    stage.extras.frustums = false;
    stage.look(this.seat.robot);
    this.panel.border(true);
    this.panel.camera(scene.head.robots[robot].camera, PICTURE_SHARE);
    this.cockpit = { hands, partners, stage, headset: new Headset(stage, hands), frame: scene.frames[0] };
    Headset.supported().then((supported) => this.panel.headset(supported));
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    scheme.addEventListener("change", () => stage.paint(), { signal: this.over.signal });
  }

  /** Receives a step. @param {import("../src/message.js").Frame} frame */
  see(frame) {
    if (!this.cockpit) return;
    const { hands } = this.cockpit;
    this.cockpit.frame = frame;
    this.stale = true;
    hands.see(frame);
    this.heightM ??= frame.row[frame.layout.robots[hands.robot].base + 3];
  }

  /** Sends the setpoints of the robot, `passedS` after the last ones. @param {number} passedS */
  say(passedS) {
    if (!this.cockpit) return;
    const { hands, headset } = this.cockpit;
    const seen = !document.hidden || Boolean(headset.session);
    const go = seen && !this.paused && !this.stepwise && !this.finishing;
    const own = wanted(this.keys, this.touch.wanted());
    const want = headset.session ? withHeadset(own, headset.wanted()) : own;
    const moves = (/** @type {number[]} */ values) => values.some((value) => value !== 0);
    if (want.clutch) {
      hands.letGo();
    } else {
      if (moves(want.wristM_s)) hands.shift(this.hand, new Vector3().fromArray(want.wristM_s).multiplyScalar(passedS));
      if (moves(want.wristRad_s)) hands.rotate(this.hand, new Vector3().fromArray(want.wristRad_s).multiplyScalar(passedS));
    }
    const { vx_m_s, vy_m_s, yaw_rate_rad_s } = want;
    const move = hands.wrists();
    Object.assign(move, { vx_m_s, vy_m_s, yaw_rate_rad_s });
    if (want.heightM_s !== 0 && this.heightM !== null) {
      const [least, most] = HEIGHT_RANGE_M;
      this.heightM = Math.max(least, Math.min(most, this.heightM + want.heightM_s * passedS));
      this.asksHeight = true;
    }
    if (this.asksHeight) move.pelvis_height_m = this.heightM;
    for (const side of SIDES) {
      const share = want.triggers[side];
      if (share !== undefined && Math.abs(share - (this.shares[side] ?? 0)) > 0.02) {
        this.shares[side] = share;
        this.fingers[side] = closedBy(side, share);
      }
      if (want.fingers?.[side]) this.fingers[side] = want.fingers[side];
      if (this.fingers[side]) move[`${side}_fingers_rad`] = this.fingers[side];
    }
    this.wheel.say({ move, go, steps: this.steps });
    this.steps = 0;
  }

  /** Moves the scene to the newest step. */
  show() {
    if (this.stale && this.cockpit) this.cockpit.stage.show(this.cockpit.frame, this.cockpit.frame, 1);
    this.stale = false;
  }

  /** Draws into a headset until its wearer leaves. */
  async wear() {
    try {
      await this.cockpit?.headset.enter(() => {
        this.show();
        return this.panel.said();
      });
    } catch (error) {
      this.panel.status(`The headset cannot be used: ${reasonOf(error)}`);
    }
  }

  /**
   * Draws the newest state, and after the episode its end, until the page is closed.
   * @param {number} now
   * @param {number} last
   */
  draw(now, last) {
    if (this.left) return;
    if (this.cockpit && !this.cockpit.headset.session) {
      const { stage } = this.cockpit;
      this.show();
      if (stage.draw() && this.pace.isSlow(now - last)) stage.simplify();
      if (!this.wheel.over) point(this.panel, this.cockpit);
    }
    requestAnimationFrame((next) => this.draw(next, now));
  }

  /** Receives messages of the server other than steps. @param {any} message */
  told(message) {
    if (message.kind === "waits") {
      const { for: robots } = message;
      this.waits = robots.length > 0 ? `Time stands still: it waits for robot ${robots.join(" and ")}, whose driver is away, has paused or is a program that thinks.` : null;
    }
    if (message.kind === "report") this.report(message.report);
    if (message.kind === "refused") this.panel.status(message.detail);
    if (message.kind === "replaced") this.panel.status("Another page drives this robot now.");
    if (message.kind === "ended") {
      this.panel.ended(message.result);
      this.done(message.result);
    }
    if (message.kind !== "refused" && message.kind !== "ended" && message.kind !== "replaced") this.standing();
  }

  /** Receives the report on a command. @param {import("./panel.js").Report} report */
  report(report) {
    for (const { from, text } of report.heard ?? []) this.panel.heard(from, text);
    for (const { robot, did } of report.partners ?? []) {
      if (did === "acted") this.gone.delete(robot);
      if (did === "held_silent" && !this.gone.has(robot)) {
        this.gone.add(robot);
        this.paused = `Paused: robot ${robot}'s person has been away for very long. It stands still if you go on.`;
        this.label();
      }
    }
    this.timeS = report.time_s;
    this.panel.facts(report, report.robots.find(({ robot }) => robot === this.seat.robot));
  }

  /** Shows the state of the episode until it is over. */
  standing() {
    if (this.wheel.over || !this.cockpit) return;
    const time = `${(this.timeS ?? this.cockpit.frame.time).toFixed(1)} s`;
    const running = `${this.stepwise ? "Step by step" : "Running"}, ${time}`;
    const finished = this.finishing ? "You have finished; the episode ends when everybody has." : null;
    this.panel.status(finished ?? this.paused ?? this.waits ?? running);
  }

  /** @param {string} action */
  act(action) {
    if (action === "left" || action === "right") this.hand = action;
    if (action === "open") this.fingers[this.hand] = OPEN[this.hand];
    if (action === "close") this.fingers[this.hand] = CLOSED[this.hand];
    if (action === "level") this.cockpit?.hands.level(this.hand);
    if (action === "clutch") this.cockpit?.hands.letGo();
    if (action === "step") this.steps += STEPS;
    if (action === "pause") this.paused = this.paused ? null : "Paused by you.";
    this.label();
  }

  label() {
    this.panel.label(this);
    if (this.cockpit) this.standing();
  }

  /** Leaves the task, also for the robots without a driver, for which nobody else would finish. */
  async finish() {
    this.finishing = true;
    this.say(0);
    try {
      await Promise.all(tokensOf(this.seat).map((token) => this.finishAs(token)));
      this.standing();
    } catch (error) {
      this.finishing = false;
      this.panel.status(reasonOf(error));
    }
  }

  /**
   * Finishes as the operator with a token. A pending command is answered first.
   * @param {string} token
   */
  async finishAs(token) {
    while (!this.wheel.over) {
      try {
        await call(`${this.root}/tools/finish`, token, {});
        return;
      } catch (error) {
        if (statusOf(error) !== 409) throw error;
        await new Promise((done) => setTimeout(done, FINISH_AGAIN_MS));
      }
    }
  }

  /**
   * Lets a handle be dragged. Dragging moves a wrist in the plane that faces the camera; with Shift, or by the wheel, along the line of sight. With Ctrl it turns the
   * hand like a ball under the pointer, and the wheel turns it about the line of sight. On touch screens buttons select the effect.
   * @param {Side} side
   */
  draggable(side) {
    const handle = this.panel.handles[side];
    const drag = (/** @type {number} */ right, /** @type {number} */ down, /** @type {number} */ away) => {
      if (!this.cockpit) return;
      const { hands, stage } = this.cockpit;
      hands.shift(side, hands.inPelvis(stage.way(hands.handle(side), right, down, away)));
      this.panel.handle(side, stage.project(hands.handle(side)));
    };
    // Not every browser reports the displacement of a finger.
    let [x, y] = [0, 0];
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      [x, y] = [event.clientX, event.clientY];
      this.act(side);
    });
    const turn = (/** @type {number} */ right, /** @type {number} */ down, /** @type {number} */ round) => {
      if (!this.cockpit) return;
      const { hands, stage } = this.cockpit;
      hands.rotate(side, hands.inPelvis(stage.axis(right, down, round)));
    };
    handle.addEventListener("contextmenu", (event) => event.preventDefault());
    handle.addEventListener("pointermove", (event) => {
      if (!handle.hasPointerCapture(event.pointerId)) return;
      const [right, down] = [event.clientX - x, event.clientY - y];
      [x, y] = [event.clientX, event.clientY];
      if (event.ctrlKey || this.touch.drag === "turn") turn(right * 0.01, down * 0.01, 0);
      else if (event.shiftKey || this.touch.drag === "along") drag(0, 0, -down * 0.002);
      else drag(right, down, 0);
    });
    handle.addEventListener("wheel", (event) => {
      event.preventDefault();
      if (event.ctrlKey) turn(0, 0, -Math.sign(event.deltaY) * 0.1);
      else drag(0, 0, -Math.sign(event.deltaY) * 0.01);
    }, { passive: false });
  }
}

/**
 * Moves handles and partners' cursors to their places in the view.
 * @param {ReturnType<typeof layOut>} panel
 * @param {Cockpit} cockpit
 */
function point(panel, { hands, partners, stage, frame }) {
  for (const side of SIDES) panel.handle(side, stage.project(hands.handle(side)));
  for (const { name, index } of partners) {
    SIDES.forEach((side, place) => {
      const target = new Vector3().fromArray(frame.row, frame.hand(index, place).target);
      panel.cursor(name, side, stage.project(target));
    });
  }
}
