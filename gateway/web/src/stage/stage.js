// An episode in three dimensions: the shapes of which the server draws the robots' images, at their poses in a step.

import {
  ArrowHelper, BufferAttribute, BufferGeometry, Color, Group, Line, LineBasicMaterial, LineSegments, LinearSRGBColorSpace, Matrix4, Mesh,
  MeshBasicMaterial, PerspectiveCamera, Quaternion, Scene, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { colour, robotColour } from "../dom.js";
import { addSky, lightByFile, lightRoom, shineOf } from "./light.js";
import { POSE, SIDES } from "../message.js";
import { Surfaces } from "./surfaces.js";
import { Textures } from "./textures.js";

const UP = new Vector3(0, 0, 1);
/** Lengths of arrows. */
const METRES_PER_NEWTON = 0.006;
const LEAST_SHOWN_N = 1;
const FRUSTUM_M = 0.55;
/** Minimum distance of a wrist from its target at which the target is drawn. */
const GHOST_FROM_M = 0.01;
/** Maximum number of the page's pixels per pixel of the picture, if drawing takes long. */
const MOST_COARSENESS = 3;
/** Time without motion after which a picture is drawn once more, at the page's full resolution. */
const STILL_MS = 300;
const SOFTWARE_COARSENESS = 1.5;
/** @type {Record<string, string>} */
const STATE_COLOURS = { moving: "--accent", arrived: "--good", blocked: "--bad", out_of_reach: "--odd", joints: "--soft" };

/** @typedef {import("../message.js").Frame} Frame */
/** @typedef {import("../targets.js").Target} Target */
/** @typedef {ReturnType<Stage["extrasOf"]>["hands"][number]} HandExtras Drawing of a hand. */
/**
 * Moves an object to the pose at a place of a row.
 * @typedef {(thing: import("three").Object3D, at: number) => void} Poser
 */

/** The drawing of one scene. */
export class Stage {
  /**
   * @param {HTMLElement} place
   * @param {Omit<import("../message.js").Scene, "frames">} scene
   * @param {import("./textures.js").TextureSource} source gives images on surfaces.
   */
  constructor(place, { head, meshes, layout }, source) {
    this.head = head;
    this.layout = layout;
    this.place = place;
    // Without a graphics processor, smooth edges and shadows take two thirds of the time, and reflections twice the remaining time.
    const quick = !drawnBySoftware();
    this.coarseness = quick ? 1 : SOFTWARE_COARSENESS;
    this.renderer = new WebGLRenderer({ antialias: quick, powerPreference: "high-performance" });
    this.renderer.shadowMap.enabled = quick;
    place.append(this.renderer.domElement);
    this.scene = new Scene();
    /** True if the file's lights multiply its colour values directly. No value is linear light then. */
    this.isLitByFile = head.lights !== null;
    if (this.isLitByFile) this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.light = head.lights ? lightByFile(this.scene, head.lights, quick) : lightRoom(this.renderer, this.scene, quick);
    this.textures = new Textures(head.textures, source, this.isLitByFile);
    /** @type {import("./surfaces.js").Surface[]} */
    this.shapes = [];
    this.carriers = this.build(meshes, quick);
    this.free = new PerspectiveCamera((head.third_person.vertical_fov_rad * 180) / Math.PI, 1, 0.02, 60);
    this.free.up.copy(UP);
    this.free.position.fromArray(head.third_person.pose);
    this.head_camera = new PerspectiveCamera(60, 1, 0.02, 60);
    this.controls = new OrbitControls(this.free, this.renderer.domElement);
    this.controls.maxDistance = 12;
    this.controls.addEventListener("change", () => { this.stale = true; });
    this.centred = false;
    this.isFine = false;
    this.view = "free";
    this.extras = { frustums: true, forces: true, targets: true };
    /**
     * Largest share of the height that a robot's picture takes, at the top where it is less than 1; the scene
     * goes on below it.
     */
    this.pictureShare = 1;
    this.robots = head.robots.map((robot, index) => this.extrasOf(robot, index));
    /** The space of a headset's wearer, with its camera; and the robot in whose place the wearer stands. */
    this.rig = new Group();
    this.rider = new PerspectiveCamera(60, 1, 0.02, 60);
    this.rig.add(this.rider);
    this.rig.visible = false;
    this.scene.add(this.rig);
    /** @type {number | null} */
    this.ridden = null;
    this.stale = true;
    this.drawnAt = 0;
    this.sized = new ResizeObserver(() => this.resize());
    this.sized.observe(place);
    this.resize();
    this.paint();
  }

  /** Applies the colours of the page. */
  paint() {
    this.scene.background = this.paper(colour("--sky"));
    this.robots.forEach(({ frustum, hands }, index) => {
      const paint = this.paper(robotColour(index));
      frustum.material.color.copy(paint);
      for (const { felt, contact } of hands) {
        felt.setColor(paint);
        contact.setColor(this.paper(colour("--force")));
      }
    });
    this.stale = true;
  }

  /** Returns a colour of the page in the colours of the scene. @param {string} css */
  paper(css) {
    const made = new Color(css);
    return this.isLitByFile ? made.convertLinearToSRGB() : made;
  }

  /** Applies the size of its element, at full resolution if nothing moves. */
  resize(fine = false) {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2) / (fine ? 1 : this.coarseness));
    this.renderer.setSize(width, height, false);
    this.isFine = fine;
    this.stale = true;
  }

  /**
   * Adds all shapes to the scene, and its sky. Returns the objects that move with a carrier, including lights.
   * @param {import("../message.js").Mesh[]} meshes
   * @param {boolean} quick False without a graphics processor.
   */
  build(meshes, quick) {
    const { head, light } = this;
    const surfaces = new Surfaces(this.textures, head.lights && shineOf(head.lights), quick, () => { this.stale = true; });
    const made = surfaces.make(head.parts, meshes);
    for (const { mesh } of made) this.scene.add(mesh);
    this.shapes = made.map(({ mesh }) => mesh);
    if (head.sky !== null) {
      this.textures.cube(head.sky).then((sky) => { addSky(this.scene, sky); this.stale = true; }, (error) => console.warn(error));
    }
    /** @type {{ thing: import("three").Object3D, at: number }[]} */
    const carriers = [];
    for (const { thing, carrier } of [...made.map(({ mesh, carrier }) => ({ thing: mesh, carrier })), ...light.carried]) {
      const at = this.placeOf(carrier);
      if (at !== null) carriers.push({ thing, at });
    }
    return carriers;
  }

  /**
   * Returns the place of a carrier's pose in a row, or null for the room.
   * @param {import("../message.js").Carrier} carrier
   */
  placeOf(carrier) {
    if (carrier.kind === "link") return this.layout.links[carrier.robot] + carrier.link * POSE;
    return carrier.kind === "object" ? this.layout.objects + carrier.object * POSE : null;
  }

  /**
   * Adds to the scene the extras of a robot, and returns them.
   * @param {import("../message.js").RobotHead} robot
   * @param {number} index
   */
  extrasOf(robot, index) {
    const paint = this.paper(robotColour(index));
    const frustum = new LineSegments(frustumGeometry(robot.camera), new LineBasicMaterial({ color: paint, transparent: true, opacity: 0.75 }));
    this.scene.add(frustum);
    const hands = SIDES.map(() => {
      const ghost = ghostGroup();
      const line = new Line(new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(6), 3)), new LineBasicMaterial());
      line.frustumCulled = false;
      const felt = new ArrowHelper(UP, new Vector3(), 0.1, paint);
      const contact = new ArrowHelper(UP, new Vector3(), 0.1, this.paper(colour("--force")));
      this.scene.add(ghost.group, line, felt, contact);
      return { ghost, line, felt, contact };
    });
    return { frustum, hands };
  }

  /**
   * Moves all objects to their poses at a `share` of the way from one step to the next.
   * @param {Frame} from
   * @param {Frame} to
   * @param {number} share
   * @param {import("../targets.js").Targets | null} [targets] those of a finished episode
   */
  show(from, to, share, targets) {
    const one = new Vector3();
    const turn = new Quaternion();
    const turnTo = new Quaternion();
    /** @type {Poser} */
    const pose = (thing, at) => {
      thing.position.fromArray(from.row, at).lerp(one.fromArray(to.row, at), share);
      thing.quaternion.copy(turn.fromArray(from.row, at + 3)).slerp(turnTo.fromArray(to.row, at + 3), share);
    };
    for (const { thing, at } of this.carriers) pose(thing, at);
    const middle = new Vector3();
    this.robots.forEach((robot, index) => {
      const { camera } = this.layout.robots[index];
      pose(robot.frustum, camera);
      const rides = this.ridden === index;
      if (rides) this.placeRig(to.row.subarray(camera, camera + POSE));
      // The view of a robot shows the border of its picture.
      robot.frustum.visible = rides || (this.extras.frustums && this.view !== this.head.robots[index].name);
      middle.addScaledVector(one.fromArray(to.row, this.layout.links[index]), 1 / this.robots.length);
      robot.hands.forEach((hand, side) => this.showHand(hand, to.hand(index, side), from, pose, targets?.at(from.time + share * (to.time - from.time), index, side)));
      if (this.view === this.head.robots[index].name) pose(this.head_camera, camera);
    });
    if (!this.centred) {
      this.controls.target.set(middle.x, middle.y, 0.75);
      this.controls.update();
      this.centred = true;
    }
    this.light.follow(middle);
    this.stale = true;
  }

  /**
   * Shows a hand's target and forces.
   * @param {HandExtras} extras
   * @param {ReturnType<Frame["hand"]>} hand
   * @param {Frame} from
   * @param {Poser} pose
   * @param {Target | null} [recorded] its target in a finished episode
   */
  showHand({ ghost, line, felt, contact }, hand, from, pose, recorded) {
    const paint = this.paper(colour(STATE_COLOURS[recorded?.state ?? hand.state] ?? "--soft"));
    const wrist = new Vector3().fromArray(from.row, hand.wrist);
    if (recorded) {
      ghost.group.position.fromArray(recorded.pose);
      ghost.group.quaternion.fromArray(recorded.pose, 3);
    } else {
      pose(ghost.group, hand.target);
    }
    const { position } = ghost.group;
    ghost.group.visible = line.visible = this.extras.targets && position.distanceTo(wrist) > GHOST_FROM_M;
    for (const material of ghost.materials) material.color.copy(paint);
    line.material.color.copy(paint);
    const ends = line.geometry.getAttribute("position");
    ends.setXYZ(0, wrist.x, wrist.y, wrist.z);
    ends.setXYZ(1, position.x, position.y, position.z);
    ends.needsUpdate = true;
    arrow(felt, wrist, hand.felt, this.extras.forces);
    arrow(contact, wrist, hand.contact, this.extras.forces);
  }

  /** Selects the free camera, or the camera of the robot called `view`. @param {string} view */
  look(view) {
    this.view = view;
    this.controls.enabled = view === "free";
    this.stale = true;
  }

  /** Draws, if the scene or the view has changed. Returns true if so. */
  draw() {
    this.controls.update();
    const isStill = !this.stale && !this.isFine && this.coarseness > 1 && performance.now() - this.drawnAt > STILL_MS;
    if (!this.stale && !isStill) return false;
    if (this.isFine || isStill) this.resize(isStill);
    this.stale = false;
    this.renderer.render(this.scene, this.camera());
    this.drawnAt = performance.now();
    return !isStill;
  }

  /** Returns the present camera, fitted to the size of the element. */
  camera() {
    const { clientWidth: width, clientHeight: height } = this.place;
    const robot = this.head.robots.find(({ name }) => name === this.view);
    const camera = robot ? this.head_camera : this.free;
    let wholePixels = height;
    if (robot) {
      // The whole picture is visible, and beside or below it as much as the element has space for.
      const picturePixels = Math.min(this.pictureShare * height, (width * robot.camera.height) / robot.camera.width);
      // A camera looks along the middle of what it draws, whose upper end is not shown where the picture is at the top.
      if (this.pictureShare < 1) wholePixels = 2 * height - picturePixels;
      camera.fov = (2 * Math.atan((Math.tan(robot.camera.vertical_fov_rad / 2) * wholePixels) / picturePixels) * 180) / Math.PI;
    }
    camera.setViewOffset(width, wholePixels, 0, wholePixels - height, width, height);
    return camera;
  }

  /** Puts a headset's wearer in the place of a robot; null removes the wearer. @param {number | null} robot */
  ride(robot) {
    this.ridden = robot;
    this.rig.visible = robot !== null;
    this.stale = true;
  }

  /**
   * Moves the wearer's space to the eye of the robot, upright and in the robot's direction. A tilted camera thus
   * does not tilt the wearer's view.
   * @param {Float32Array} pose
   */
  placeRig(pose) {
    const ahead = new Vector3(0, 0, -1).applyQuaternion(new Quaternion().fromArray(pose, 3));
    const back = ahead.setZ(0).normalize().negate();
    this.rig.position.fromArray(pose);
    this.rig.quaternion.setFromRotationMatrix(new Matrix4().makeBasis(UP.clone().cross(back), UP, back));
    this.rig.updateMatrixWorld(true);
  }

  /** Draws for a headset, both eyes. */
  drawHeadset() {
    this.renderer.render(this.scene, this.rider);
  }

  /**
   * Returns the place of a point of the world in the view: x to the right and y up, from -1 to 1 within the element. `ahead`
   * is true if it is in front of the camera.
   * @param {Vector3} point
   */
  project(point) {
    const camera = this.camera();
    camera.updateMatrixWorld();
    const seen = point.clone().applyMatrix4(camera.matrixWorldInverse);
    const { x, y } = point.clone().project(camera);
    return { x, y, ahead: seen.z < 0 };
  }

  /**
   * Returns the displacement of a point of the world whose picture moves by pixels to the right and down, and which moves away by metres.
   * @param {Vector3} point
   * @param {number} right
   * @param {number} down
   * @param {number} away
   */
  way(point, right, down, away) {
    const camera = this.camera();
    camera.updateMatrixWorld();
    const depth = Math.max(0.1, -point.clone().applyMatrix4(camera.matrixWorldInverse).z);
    const wholePixels = camera.view?.fullHeight ?? this.place.clientHeight;
    const metres = (2 * depth * Math.tan((camera.fov * Math.PI) / 360)) / wholePixels;
    return new Vector3(right * metres, -down * metres, -away).applyQuaternion(camera.quaternion);
  }

  /**
   * Returns the axis and angle, in the world, of a ball that a pointer turns to the right and down, or about the line of sight.
   * @param {number} right
   * @param {number} down
   * @param {number} round
   */
  axis(right, down, round) {
    return new Vector3(down, right, round).applyQuaternion(this.camera().quaternion);
  }

  /** Frees limited resources of the page, which may draw one episode after another. */
  leave() {
    this.sized.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Simplifies slow drawing: first without shadows, then with fewer pixels. */
  simplify() {
    if (!this.light.casting.some(({ castShadow }) => castShadow)) {
      this.coarseness = Math.min(MOST_COARSENESS, this.coarseness * 1.5);
      this.resize();
      return;
    }
    this.renderer.shadowMap.enabled = false;
    for (const light of this.light.casting) light.castShadow = false;
    for (const { material } of this.shapes) material.needsUpdate = true;
    this.stale = true;
  }
}

/** Number of frames whose mean duration is compared with the limit. */
const JUDGED_FRAMES = 20;
/** Minimum duration that means a page in the background, which does not count as slow. */
const NOT_DRAWN_MS = 1000;

/** Detects drawing that takes longer than `mostMs` a frame on average. */
export class Pace {
  /** @param {number} mostMs */
  constructor(mostMs) {
    this.mostMs = mostMs;
    this.frames = 0;
    this.totalMs = 0;
  }

  /**
   * Counts a frame that came `ms` after the last one. Returns true if the last `JUDGED_FRAMES` frames were too
   * slow.
   * @param {number} ms
   */
  isSlow(ms) {
    if (ms > NOT_DRAWN_MS) return false;
    this.frames += 1;
    this.totalMs += ms;
    if (this.frames < JUDGED_FRAMES) return false;
    const mean = this.totalMs / this.frames;
    [this.frames, this.totalMs] = [0, 0];
    return mean > this.mostMs;
  }
}

/** Returns true if software draws instead of a graphics processor. */
function drawnBySoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return false;
  const names = context.getExtension("WEBGL_debug_renderer_info");
  const name = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/**
 * Returns the edges of a camera's view volume. The camera looks along -z with y up.
 * @param {import("../message.js").CameraHead} camera
 */
function frustumGeometry({ vertical_fov_rad: fov, width, height }) {
  const y = FRUSTUM_M * Math.tan(fov / 2);
  const x = (y * width) / height;
  const corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(([a, b]) => [a, b, -FRUSTUM_M]);
  const ends = corners.flatMap((corner, index) => [[0, 0, 0], corner, corner, corners[(index + 1) % 4]]);
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(ends.flat()), 3));
}

/** Makes a wrist's target: a ball, and axes that show the hand's orientation. */
function ghostGroup() {
  const group = new Group();
  const material = new MeshBasicMaterial({ transparent: true, opacity: 0.55, depthTest: false });
  const ball = new Mesh(new SphereGeometry(0.022, 16, 12), material);
  const ends = new Float32Array([0, 0, 0, 0.1, 0, 0, 0, 0, 0, 0, 0.05, 0, 0, 0, 0, 0, 0, 0.05]);
  const paint = new LineBasicMaterial({ depthTest: false });
  const axes = new LineSegments(new BufferGeometry().setAttribute("position", new BufferAttribute(ends, 3)), paint);
  group.add(ball, axes);
  group.renderOrder = ball.renderOrder = axes.renderOrder = 5;
  return { group, materials: [material, paint] };
}

/**
 * Shows a force as an arrow.
 * @param {ArrowHelper} helper
 * @param {Vector3} at
 * @param {number[]} force
 * @param {boolean} wanted
 */
function arrow(helper, at, force, wanted) {
  const along = new Vector3().fromArray(force);
  const newtons = along.length();
  helper.visible = wanted && newtons > LEAST_SHOWN_N;
  if (!helper.visible) return;
  helper.position.copy(at);
  helper.setDirection(along.divideScalar(newtons));
  helper.setLength(Math.min(0.06 + newtons * METRES_PER_NEWTON, 0.8), 0.04, 0.025);
}
