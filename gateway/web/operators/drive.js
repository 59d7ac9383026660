// One person drives one robot, in three dimensions. What the page says goes out 50 times a second; the server makes commands of it while
// everybody is there, so that time stands still while a person's page is closed or out of view.

import { Vector3 } from "three";
import { SIDES } from "../src/message.js";
import { Pace, Stage } from "../src/stage.js";
import { call } from "./call.js";
import { Hands } from "./hands.js";
import { Headset } from "./headset/headset.js";
import { CLOSED, OPEN, closedBy, listen, wanted, withHeadset } from "./inputs.js";
import { layOut, nothing } from "./panel.js";
import { Touch } from "./touch.js";
import { Wheel, tokensOf } from "./wheel.js";

const SAY_MS = 20;
const HEIGHT_RANGE_M = [0.5, 0.78];
/** Where drawing takes longer, it is made simpler: a hand is seen to move two frames after it has. */
const SLOW_FRAME_MS = 40;
/** Control steps of a press of the step button. */
const STEPS = 10;
/** A command that is under way takes no longer. */
const FINISH_AGAIN_MS = 300;
/** How much of the height the robot's picture takes: below it are the robot's own hands, where they hang. */
const PICTURE_SHARE = 0.7;

/** Shows the page of `seat` and drives until the episode has ended. Returns its result, and what gives back what the page draws with. */
export async function drive(main, seat) {
  const root = `/v1/episodes/${encodeURIComponent(seat.episode)}`;
  try {
    await call("/operate/enter", seat.token, {}, { credentials: "same-origin" });
  } catch (error) {
    return nothing(main, error.status === 403 ? "This link drives no robot here." : error.message);
  }
  const briefing = await call(`${root}/briefing`, seat.token).catch((error) => error);
  if (briefing instanceof Error) return nothing(main, briefing.message);
  return new DrivePage(main, seat, root, briefing).drive();
}

class DrivePage {
  constructor(main, seat, root, briefing) {
    Object.assign(this, { seat, root, hand: "right", fingers: {}, shares: {}, heightM: null, paused: null, stepwise: false, steps: 0, gone: new Set(), over: new AbortController(), left: false, touch: new Touch() });
    this.panel = layOut(main, seat, briefing, this.touch.parts, {
      act: (action) => this.act(action),
      speak: (text) => call(`${root}/tools/say`, seat.token, { text }),
      finish: () => this.finish(),
      look: (view) => { this.stage?.look(view === "robot" ? seat.robot : "free"); this.panel.border(view === "robot"); },
      wear: () => this.wear(),
      stepwise: (on) => { this.stepwise = on; this.label(); },
    });
    SIDES.forEach((side) => this.draggable(side));
    this.label();
    this.wheel = new Wheel(seat, {
      scene: (scene) => this.begin(scene),
      frame: (frame) => this.see(frame),
      told: (message) => this.told(message),
      lost: (why) => this.panel.status(why),
    });
  }

  /** Drives until the episode is over. The last of it stays to be seen. */
  drive() {
    this.keys = listen((key) => {
      const action = { 1: "left", 2: "right", o: "open", c: "close", h: "level", " ": "clutch", Enter: this.stepwise ? "step" : null }[key];
      if (action) this.act(action);
      return Boolean(action);
    }, this.over.signal);
    this.wheel.connect();
    let said = performance.now();
    const saying = setInterval(() => {
      const now = performance.now();
      this.say(Math.min(now - said, 100) / 1000);
      said = now;
    }, SAY_MS);
    document.addEventListener("visibilitychange", () => this.say(0), { signal: this.over.signal });
    this.pace = new Pace(SLOW_FRAME_MS);
    requestAnimationFrame((now) => this.draw(now, now));
    return new Promise((done) => { this.done = done; }).then((result) => {
      clearInterval(saying);
      this.over.abort();
      this.wheel.close();
      const leave = () => {
        this.left = true;
        this.headset?.leave();
        this.stage?.leave();
      };
      return { result, leave };
    });
  }

  /** The scene has come, for the first time or after the link was lost. */
  begin(scene) {
    if (this.stage) return;
    const robot = scene.head.robots.findIndex(({ name }) => name === this.seat.robot);
    this.hands = new Hands(robot);
    this.partners = scene.head.robots.map(({ name }, index) => ({ name, index })).filter(({ index }) => index !== robot);
    this.stage = new Stage(this.panel.view, scene);
    this.stage.pictureShare = PICTURE_SHARE;
    // What partners see is not what this person looks for.
    this.stage.extras.frustums = false;
    this.stage.look(this.seat.robot);
    this.panel.border(true, scene.head.robots[robot].camera, PICTURE_SHARE);
    this.headset = new Headset(this.stage, this.hands);
    Headset.supported().then((supported) => this.panel.headset(supported));
    const scheme = matchMedia("(prefers-color-scheme: dark)");
    scheme.addEventListener("change", () => this.stage.paint(), { signal: this.over.signal });
  }

  see(frame) {
    this.frame = frame;
    this.stale = true;
    this.hands.see(frame);
    this.heightM ??= frame.row[frame.layout.robots[this.hands.robot].base + 3];
  }

  /** Says what the robot is to do, after `passedS` more. */
  say(passedS) {
    if (!this.hands) return;
    const seen = !document.hidden || this.headset.session;
    const go = seen && !this.paused && !this.stepwise && !this.finishing;
    const own = wanted(this.keys, this.touch.wanted());
    const want = this.headset.session ? withHeadset(own, this.headset.wanted()) : own;
    const moves = (values) => values.some((value) => value !== 0);
    if (want.clutch) {
      this.hands.letGo();
    } else {
      if (moves(want.wristM_s)) this.hands.shift(this.hand, new Vector3(...want.wristM_s).multiplyScalar(passedS));
      if (moves(want.wristRad_s)) this.hands.rotate(this.hand, new Vector3(...want.wristRad_s).multiplyScalar(passedS));
    }
    const move = this.hands.wrists();
    for (const key of ["vx_m_s", "vy_m_s", "yaw_rate_rad_s"]) move[key] = want[key];
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

  /** Puts the scene to where the newest step has it. */
  show() {
    if (this.stale) this.stage.show(this.frame, this.frame, 1);
    this.stale = false;
  }

  /** Draws into a headset until its wearer leaves. */
  async wear() {
    try {
      await this.headset.enter(() => {
        this.show();
        return this.panel.said();
      });
    } catch (error) {
      this.panel.status(`The headset cannot be used: ${error.message}`);
    }
  }

  /** Draws what is newest, and when the episode is over, its end, until the page is left. */
  draw(now, last) {
    if (this.left) return;
    if (this.stage && !this.headset.session) {
      this.show();
      if (this.stage.draw() && this.pace.isSlow(now - last)) this.stage.simplify();
      if (!this.wheel.over) this.point();
    }
    requestAnimationFrame((next) => this.draw(next, now));
  }

  /** Puts handles and partners' cursors to where they are seen. */
  point() {
    for (const side of SIDES) this.panel.handle(side, this.stage.project(this.hands.handle(side)));
    for (const { name, index } of this.partners) {
      SIDES.forEach((side, place) => {
        const target = new Vector3().fromArray(this.frame.row, this.frame.hand(index, place).target);
        this.panel.cursor(name, side, this.stage.project(target));
      });
    }
  }

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

  /** Takes in the report on a command. */
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
    this.time_s = report.time_s;
    this.panel.facts(report, report.robots.find(({ robot }) => robot === this.seat.robot));
  }

  /** Says how things stand, until the episode is over. */
  standing() {
    if (this.wheel.over) return undefined;
    if (this.finishing) return this.panel.status("You have finished; the episode ends when everybody has.");
    if (this.paused) return this.panel.status(this.paused);
    if (this.waits) return this.panel.status(this.waits);
    return this.panel.status(`${this.stepwise ? "Step by step" : "Running"}, ${(this.time_s ?? this.frame.time).toFixed(1)} s`);
  }

  act(action) {
    if (SIDES.includes(action)) this.hand = action;
    if (action === "open") this.fingers[this.hand] = OPEN[this.hand];
    if (action === "close") this.fingers[this.hand] = CLOSED[this.hand];
    if (action === "level") this.hands?.level(this.hand);
    if (action === "clutch") this.hands?.letGo();
    if (action === "step") this.steps += STEPS;
    if (action === "pause") this.paused = this.paused ? null : "Paused by you.";
    this.label();
  }

  label() {
    this.panel.label(this);
    if (this.frame) this.standing();
  }

  /** Leaves the task, with the robots that stand still beside this one, which nobody else would have finish. */
  async finish() {
    this.finishing = true;
    this.say(0);
    try {
      await Promise.all(tokensOf(this.seat).map((token) => this.finishAs(token)));
      this.standing();
    } catch (error) {
      this.finishing = false;
      this.panel.status(error.message);
    }
  }

  /** Finishes as the operator with a token; a command that is under way is answered first. */
  async finishAs(token) {
    while (!this.wheel.over) {
      try {
        await call(`${this.root}/tools/finish`, token, {});
        return;
      } catch (error) {
        if (error.status !== 409) throw error;
        await new Promise((done) => setTimeout(done, FINISH_AGAIN_MS));
      }
    }
  }

  /**
   * Dragging moves a wrist in the plane that faces the camera; with Shift, or by the wheel, along the line of sight. With Ctrl it turns the
   * hand as a ball is turned that lies under the pointer, and the wheel turns it about the line of sight. Fingers choose by buttons.
   */
  draggable(side) {
    const handle = this.panel.handles[side];
    const drag = (right, down, away) => {
      if (!this.hands) return;
      this.hands.shift(side, this.hands.inPelvis(this.stage.way(this.hands.handle(side), right, down, away)));
      this.panel.handle(side, this.stage.project(this.hands.handle(side)));
    };
    // Not every browser says of a finger how far it has moved.
    let [x, y] = [0, 0];
    handle.addEventListener("pointerdown", (event) => {
      handle.setPointerCapture(event.pointerId);
      [x, y] = [event.clientX, event.clientY];
      this.act(side);
    });
    const turn = (right, down, round) => {
      if (!this.hands) return;
      this.hands.rotate(side, this.hands.inPelvis(this.stage.axis(right, down, round)));
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
