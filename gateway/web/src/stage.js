// An episode in three dimensions: the shapes that the server draws robots' pictures of, put where a step has them.

import {
  AmbientLight, ArrowHelper, BufferAttribute, BufferGeometry, Color, DirectionalLight, Group, HemisphereLight, Line, LineBasicMaterial,
  LineSegments, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Quaternion, SRGBColorSpace, Scene, SphereGeometry,
  Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { colour, robotColour } from "./dom.js";
import { POSE, SIDES } from "./message.js";

/** Alpha from which surfaces are solid, as in the server's images. */
const SOLID_ALPHA = 0.995;
const UP = new Vector3(0, 0, 1);
/** Lengths of arrows. */
const METRES_PER_NEWTON = 0.006;
const LEAST_SHOWN_N = 1;
const FRUSTUM_M = 0.55;
/** Wrists nearer to their targets need no ghost. */
const GHOST_FROM_M = 0.01;
/** Pixels of the page that one of the picture covers, at most, where drawing takes long. */
const MOST_COARSENESS = 3;
/** Time without motion after which a picture is drawn once more, as finely as the page is. */
const STILL_MS = 300;
const SOFTWARE_COARSENESS = 1.5;
/** @type {Record<string, string>} */
const STATE_COLOURS = { moving: "--accent", arrived: "--good", blocked: "--bad", out_of_reach: "--odd", joints: "--soft" };
const SKY_FROM_BELOW = 0x8d8678;

/** @typedef {import("./message.js").Frame} Frame */
/** @typedef {import("./message.js").Part} Part */
/** @typedef {import("./message.js").Mesh} MeshNumbers */
/** @typedef {import("./targets.js").Target} Target */
/** @typedef {ReturnType<Stage["extrasOf"]>["hands"][number]} HandExtras Drawing of a hand. */
/**
 * Puts a thing to the pose at a place of a row.
 * @typedef {(thing: import("three").Object3D, at: number) => void} Poser
 */

/** The drawing of one scene. */
export class Stage {
  /** @param {HTMLElement} place @param {Omit<import("./message.js").Scene, "frames">} scene */
  constructor(place, { head, meshes, layout }) {
    this.head = head;
    this.layout = layout;
    this.place = place;
    // Where a processor draws, smooth edges and shadows take two thirds of the time.
    const quick = !drawnBySoftware();
    this.coarseness = quick ? 1 : SOFTWARE_COARSENESS;
    this.renderer = new WebGLRenderer({ antialias: quick, powerPreference: "high-performance" });
    this.renderer.shadowMap.enabled = quick;
    place.append(this.renderer.domElement);
    this.scene = new Scene();
    this.sun = this.light(quick);
    this.carriers = this.build(meshes);
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

  /** Takes over the colours of the page. */
  paint() {
    this.scene.background = new Color(colour("--sky"));
    this.robots.forEach(({ frustum, hands }, index) => {
      const paint = new Color(robotColour(index));
      frustum.material.color.copy(paint);
      for (const { felt, contact } of hands) {
        felt.setColor(paint);
        contact.setColor(new Color(colour("--force")));
      }
    });
    this.stale = true;
  }

  /** Takes over the size of the place; in fine pixels where nothing moves. */
  resize(fine = false) {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2) / (fine ? 1 : this.coarseness));
    this.renderer.setSize(width, height, false);
    this.isFine = fine;
    this.stale = true;
  }

  /** Adds lights to the scene. Returns the one that casts shadows, if any does. @param {boolean} casts */
  light(casts) {
    this.scene.add(new HemisphereLight(0xffffff, SKY_FROM_BELOW, 1.6), new AmbientLight(0xffffff, 0.35));
    const sun = new DirectionalLight(0xffffff, 2.1);
    sun.castShadow = casts;
    sun.shadow.mapSize.set(1024, 1024);
    Object.assign(sun.shadow.camera, { left: -2.2, right: 2.2, top: 2.2, bottom: -2.2, near: 0.5, far: 9 });
    sun.shadow.bias = -0.0015;
    sun.shadow.normalBias = 0.02;
    this.scene.add(sun, sun.target);
    return sun;
  }

  /**
   * Makes one mesh for all parts of a carrier that are alike in shadow and alpha. Returns the carriers that
   * move.
   * @param {MeshNumbers[]} meshes
   */
  build(meshes) {
    /** @type {Map<string, Part[]>} */
    const groups = new Map();
    for (const part of this.head.parts) {
      const key = `${JSON.stringify(part.carrier)} ${part.casts_shadow} ${part.alpha}`;
      groups.set(key, [...(groups.get(key) ?? []), part]);
    }
    const carriers = [];
    /** @type {Mesh<BufferGeometry, MeshLambertMaterial>[]} */
    this.shapes = [];
    for (const parts of groups.values()) {
      const plain = parts.filter((part) => part.pattern !== "checker");
      const checked = parts.filter((part) => part.pattern === "checker");
      /** @type {[Part[], MeshLambertMaterial][]} */
      const lots = checked.map((part) => [[part], checker(part)]);
      if (plain.length) lots.unshift([plain, paintOf(parts[0])]);
      for (const [some, material] of lots) {
        const mesh = new Mesh(merged(some, meshes), material);
        mesh.castShadow = some[0].casts_shadow;
        mesh.receiveShadow = true;
        this.scene.add(mesh);
        this.shapes.push(mesh);
        const at = this.placeOf(some[0].carrier);
        if (at !== null) carriers.push({ mesh, at });
      }
    }
    return carriers;
  }

  /**
   * Returns the place of a carrier's pose in a row, or null for the room.
   * @param {import("./message.js").Carrier} carrier
   */
  placeOf(carrier) {
    if (carrier.kind === "link") return this.layout.links[carrier.robot] + carrier.link * POSE;
    return carrier.kind === "object" ? this.layout.objects + carrier.object * POSE : null;
  }

  /**
   * Adds to the scene the extras of a robot, and returns them.
   * @param {import("./message.js").RobotHead} robot
   * @param {number} index
   */
  extrasOf(robot, index) {
    const paint = new Color(robotColour(index));
    const frustum = new LineSegments(frustumGeometry(robot.camera), new LineBasicMaterial({ color: paint, transparent: true, opacity: 0.75 }));
    this.scene.add(frustum);
    const hands = SIDES.map(() => {
      const ghost = ghostGroup();
      const line = new Line(new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(6), 3)), new LineBasicMaterial());
      line.frustumCulled = false;
      const felt = new ArrowHelper(UP, new Vector3(), 0.1, paint);
      const contact = new ArrowHelper(UP, new Vector3(), 0.1, colour("--force"));
      this.scene.add(ghost.group, line, felt, contact);
      return { ghost, line, felt, contact };
    });
    return { frustum, hands };
  }

  /**
   * Puts everything where it is a `share` of the way from one step to the next.
   * @param {Frame} from
   * @param {Frame} to
   * @param {number} share
   * @param {import("./targets.js").Targets | null} [targets] those of a finished episode
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
    for (const { mesh, at } of this.carriers) pose(mesh, at);
    const middle = new Vector3();
    this.robots.forEach((robot, index) => {
      const { camera } = this.layout.robots[index];
      pose(robot.frustum, camera);
      const rides = this.ridden === index;
      if (rides) this.placeRig(to.row.subarray(camera, camera + POSE));
      // Whoever rides a robot sees the border of its picture.
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
    this.sun.target.position.set(middle.x, middle.y, 0.6);
    this.sun.position.set(middle.x - 0.9, middle.y - 1.3, 4.6);
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
    const paint = new Color(colour(STATE_COLOURS[recorded?.state ?? hand.state] ?? "--soft"));
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

  /** Looks with the free camera, or as a robot called `view` does. @param {string} view */
  look(view) {
    this.view = view;
    this.controls.enabled = view === "free";
    this.stale = true;
  }

  /** Draws, if anything has changed. Returns whether it has. */
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

  /** Returns the camera that looks now, as the place's size wants it. */
  camera() {
    const { clientWidth: width, clientHeight: height } = this.place;
    const robot = this.head.robots.find(({ name }) => name === this.view);
    const camera = robot ? this.head_camera : this.free;
    let wholePixels = height;
    if (robot) {
      // The whole of its picture is seen, and beside or below it what the place has room for.
      const picturePixels = Math.min(this.pictureShare * height, (width * robot.camera.height) / robot.camera.width);
      // A camera looks along the middle of what it draws, whose upper end is not shown where the picture is at the top.
      if (this.pictureShare < 1) wholePixels = 2 * height - picturePixels;
      camera.fov = (2 * Math.atan((Math.tan(robot.camera.vertical_fov_rad / 2) * wholePixels) / picturePixels) * 180) / Math.PI;
    }
    camera.setViewOffset(width, wholePixels, 0, wholePixels - height, width, height);
    return camera;
  }

  /** Puts a headset's wearer in the place of a robot, or, for null, nobody. @param {number | null} robot */
  ride(robot) {
    this.ridden = robot;
    this.rig.visible = robot !== null;
    this.stale = true;
  }

  /**
   * Puts the wearer's space to the eye of the robot, upright, facing where the robot faces: nobody's neck is
   * bent by a tilted camera.
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
   * Returns where a point of the world is seen: x to the right and y up, from -1 to 1 within the place; and
   * tells whether it is ahead.
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
   * Returns how far a point of the world moves where its picture moves by pixels to the right and down, and it goes away by metres.
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
   * Returns the axis and angle, in the world, by which a ball turns that a pointer moves to the right and down, or round the line of sight.
   * @param {number} right
   * @param {number} down
   * @param {number} round
   */
  axis(right, down, round) {
    return new Vector3(down, right, round).applyQuaternion(this.camera().quaternion);
  }

  /** Gives back what a page has few of, where it draws one episode after another. */
  leave() {
    this.sized.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  /** Draws less, where drawing takes long: first no shadows, then fewer pixels. */
  simplify() {
    if (!this.sun.castShadow) {
      this.coarseness = Math.min(MOST_COARSENESS, this.coarseness * 1.5);
      this.resize();
      return;
    }
    this.renderer.shadowMap.enabled = false;
    this.sun.castShadow = false;
    for (const { material } of this.shapes) material.needsUpdate = true;
    this.stale = true;
  }
}

/** Frames over which it is judged whether drawing takes long. */
const JUDGED_FRAMES = 20;
/** A page in the background is not drawn, and so is not slow. */
const NOT_DRAWN_MS = 1000;

/** A judge that says when drawing takes longer, over some frames, than `mostMs` a frame. */
export class Pace {
  /** @param {number} mostMs */
  constructor(mostMs) {
    this.mostMs = mostMs;
    this.frames = 0;
    this.totalMs = 0;
  }

  /**
   * Takes in that another frame came `ms` after the last. Returns whether they come too slowly, once for
   * `JUDGED_FRAMES`.
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

/** Tells whether a processor draws in place of a graphics processor. */
function drawnBySoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  if (!context) return false;
  const names = context.getExtension("WEBGL_debug_renderer_info");
  const name = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

/**
 * Makes the material of a part without a pattern. What is blended keeps out as much light as in the server's
 * images.
 * @param {Part} part
 */
function paintOf({ alpha }) {
  const blended = alpha < SOLID_ALPHA ? { transparent: true, depthWrite: false, opacity: 1 - (1 - alpha) ** 2 } : {};
  return new MeshLambertMaterial({ vertexColors: true, ...blended });
}

/**
 * Makes the material of squares of half a metre in the world's ground plane, as the server draws them.
 * @param {import("./message.js").CheckedPart} part
 */
function checker(part) {
  const material = new MeshLambertMaterial({ vertexColors: true });
  const second = new Color().setRGB(...part.second_rgb, SRGBColorSpace);
  material.onBeforeCompile = (shader) => {
    shader.uniforms.second = { value: second };
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;")
      .replace("#include <project_vertex>", "#include <project_vertex>\nvPlace = (modelMatrix * vec4(transformed, 1.0)).xyz;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;\nuniform vec3 second;")
      .replace("#include <color_fragment>", "#include <color_fragment>\nif (mod(floor(vPlace.x * 2.0) + floor(vPlace.y * 2.0), 2.0) == 0.0) diffuseColor.rgb = second;");
  };
  return material;
}

/**
 * Returns parts of one carrier as one geometry in its frame, with their colours at the corners.
 * @param {Part[]} parts
 * @param {MeshNumbers[]} meshes
 */
function merged(parts, meshes) {
  const total = parts.reduce((sum, part) => sum + meshes[part.mesh].positions.length, 0);
  const positions = new Float32Array(total);
  const normals = new Float32Array(total);
  const colours = new Float32Array(total);
  const indices = [];
  const point = new Vector3();
  const turn = new Quaternion();
  let first = 0;
  for (const part of parts) {
    const mesh = meshes[part.mesh];
    const paint = new Color().setRGB(...part.rgb, SRGBColorSpace);
    const corners = mesh.positions.length / 3;
    turn.fromArray(part.pose, 3);
    for (let corner = 0; corner < corners; corner += 1) {
      const at = 3 * (first + corner);
      point.fromArray(mesh.positions, 3 * corner).applyQuaternion(turn);
      point.x += part.pose[0];
      point.y += part.pose[1];
      point.z += part.pose[2];
      point.toArray(positions, at);
      point.set(mesh.normals[4 * corner], mesh.normals[4 * corner + 1], mesh.normals[4 * corner + 2]).normalize();
      point.applyQuaternion(turn).toArray(normals, at);
      paint.toArray(colours, at);
    }
    for (const corner of mesh.indices) indices.push(first + corner);
    first += corners;
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
  geometry.setIndex(indices);
  return geometry;
}

/**
 * Returns the edges of what a camera sees, which looks along -z with y up.
 * @param {import("./message.js").CameraHead} camera
 */
function frustumGeometry({ vertical_fov_rad: fov, width, height }) {
  const y = FRUSTUM_M * Math.tan(fov / 2);
  const x = (y * width) / height;
  const corners = [[-x, -y], [x, -y], [x, y], [-x, y]].map(([a, b]) => [a, b, -FRUSTUM_M]);
  const ends = corners.flatMap((corner, index) => [[0, 0, 0], corner, corner, corners[(index + 1) % 4]]);
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(ends.flat()), 3));
}

/** Makes a wrist's target: a ball, and axes that say how the hand is turned. */
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
