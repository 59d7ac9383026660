// The light of a scene. Rooms have surrounding walls and lamps, and a sun that casts shadows. Scenes whose file has lights have these.

import {
  AmbientLight, BackSide, BoxGeometry, Color, DirectionalLight, FrontSide, Group, HemisphereLight, Mesh, MeshBasicMaterial, PMREMGenerator, PointLight,
  Scene, ShaderMaterial, SpotLight, Vector3,
} from "three";

/** Texels of a map of shadows along each side. */
const SHADOW_TEXELS = 1024;
/** Distance around the robots within which a sun and a directional light cast shadows. */
const [SUN_RADIUS_M, LAMP_RADIUS_M] = [2.2, 2.5];
/** Distance of such a light from the middle of the robots. */
const AWAY_M = 6;
/** Maximum number of a file's lights that cast shadows. Each takes another picture of the scene. */
const MOST_SHADOWS = 2;
/** Side of the cube with the sky, within what cameras see. */
const SKY_M = 20;
const HEAD_HEIGHT_M = 0.8;

/** The room whose light surrounds a scene: sides, floor and ceiling, and lamps below that, as linear colours. */
const AROUND = { size_m: [9, 9, 4.5], side: [0.55, 0.54, 0.51], floor: [0.22, 0.2, 0.18], ceiling: [0.46, 0.46, 0.45], lamp: [4.2, 4.1, 3.9] };
const LAMP_SIZE_M = [1.8, 1.2, 0.05];
const LAMPS_AT_M = [[-2, -2], [-2, 2], [2, -2], [2, 2]];
const SUN_INTENSITY = 1.1;
/** Light of that room on surfaces that face up and down, for drawing without a graphics processor. */
const [ABOVE, BELOW] = [[0.84, 0.83, 0.8], [0.28, 0.26, 0.24]];

/** @typedef {import("../message.js").Lamp} Lamp */
/** @typedef {import("../message.js").Lights} Lights */
/** @typedef {import("../message.js").Rgb} Rgb */
/**
 * Lights of a scene: those that cast shadows, those that objects carry, with their carriers, and a function that makes lights follow the robots.
 * @typedef {{
 *   casting: (DirectionalLight | SpotLight)[], carried: { thing: import("three").Object3D, carrier: import("../message.js").Carrier }[],
 *   follow: (middle: Vector3) => void,
 * }} SceneLight
 */

/**
 * Lights a scene whose file has no lights. Reflections of a room and shadows are for graphics processors.
 * @param {import("three").WebGLRenderer} renderer
 * @param {Scene} scene
 * @param {boolean} casts
 * @returns {SceneLight}
 */
export function lightRoom(renderer, scene, casts) {
  if (casts) {
    const maker = new PMREMGenerator(renderer);
    scene.environment = maker.fromScene(around(), 0.02).texture;
    maker.dispose();
  } else {
    const [above, below] = [ABOVE, BELOW].map(([red, green, blue]) => new Color(red, green, blue));
    scene.add(new HemisphereLight(above, below, Math.PI));
  }
  const sun = new DirectionalLight(0xfff6ea, SUN_INTENSITY);
  shadows(sun, casts, SUN_RADIUS_M);
  scene.add(sun, sun.target);
  const follow = (/** @type {Vector3} */ { x, y }) => {
    sun.target.position.set(x, y, 0.6);
    sun.position.set(x - 0.9, y - 1.3, 4.6);
  };
  return { casting: [sun], carried: [], follow };
}

/** Makes the room that surrounds a scene. */
function around() {
  const scene = new Scene();
  const glow = (/** @type {number[]} */ [red, green, blue], /** @type {import("three").Side} */ side = BackSide) => new MeshBasicMaterial({ color: new Color(red, green, blue), side });
  const [side, floor, ceiling] = [AROUND.side, AROUND.floor, AROUND.ceiling].map((rgb) => glow(rgb));
  const [x, y, z] = AROUND.size_m;
  scene.add(new Mesh(new BoxGeometry(x, y, z), [side, side, side, side, ceiling, floor]));
  for (const [right, ahead] of LAMPS_AT_M) {
    const lamp = new Mesh(new BoxGeometry(...LAMP_SIZE_M), glow(AROUND.lamp, FrontSide));
    lamp.position.set(right, ahead, z / 2 - LAMP_SIZE_M[2]);
    scene.add(lamp);
  }
  return scene;
}

/**
 * Returns the highlights of a file's lights as a share of their light, in the mean.
 * @param {Lights} lights
 */
export function shineOf({ headlight, lamps }) {
  const sum = (/** @type {"diffuse" | "specular"} */ of) => [headlight, ...lamps].flatMap((light) => light[of]).reduce((total, value) => total + value, 0);
  return sum("diffuse") > 0 ? sum("specular") / sum("diffuse") : 0;
}

/**
 * Lights a scene by the lights of its file, whose colours are values of the file.
 * @param {Scene} scene
 * @param {Lights} lights
 * @param {boolean} casts
 * @returns {SceneLight}
 */
export function lightByFile(scene, { headlight, lamps }, casts) {
  const ambient = new Color(0, 0, 0);
  const add = (/** @type {Rgb} */ rgb) => ambient.add(new Color(...rgb));
  add(headlight.ambient);
  const head = new DirectionalLight(new Color(...headlight.diffuse), Math.PI);
  scene.add(head, head.target);
  // It shines along the optical axis of the present camera.
  scene.onBeforeRender = (_renderer, _scene, camera) => {
    head.position.setFromMatrixColumn(camera.matrixWorld, 2);
    head.updateMatrixWorld();
  };
  /** @type {SceneLight} */
  const made = { casting: [], carried: [], follow: () => {} };
  /** @type {((middle: Vector3) => void)[]} */
  const following = [];
  for (const lamp of lamps) {
    if (lamp.kind === "directional") add(lamp.ambient);
    const light = lightOf(lamp);
    const { target } = light instanceof PointLight ? { target: null } : light;
    const direction = new Vector3().fromArray(lamp.direction);
    light.position.fromArray(lamp.position_m);
    target?.position.copy(light.position).add(direction);
    const place = lamp.carrier.kind === "room" ? scene : new Group();
    place.add(light, ...(target ? [target] : []));
    if (!(light instanceof PointLight) && lamp.casts_shadow && made.casting.length < MOST_SHADOWS) {
      shadows(light, casts, LAMP_RADIUS_M);
      made.casting.push(light);
    }
    if (place !== scene) {
      scene.add(place);
      made.carried.push({ thing: place, carrier: lamp.carrier });
    } else if (light instanceof DirectionalLight) {
      following.push((middle) => {
        light.target.position.copy(middle);
        light.position.copy(middle).addScaledVector(direction, -AWAY_M);
      });
    }
  }
  scene.add(new AmbientLight(ambient, Math.PI));
  made.follow = (middle) => following.forEach((move) => move(middle));
  return made;
}

/**
 * Makes a light of a file, `Math.PI` times as strong as a surface that it illuminates vertically, by the convention of three.js.
 * @param {Lamp} lamp
 */
function lightOf({ kind, diffuse, attenuation, cutoff_rad: cutoff, exponent, position_m: [, , height] }) {
  const colour = new Color(...diffuse);
  if (kind === "directional") return new DirectionalLight(colour, Math.PI);
  const { intensity, decay } = fall(attenuation, Math.max(height - HEAD_HEIGHT_M, 0.5));
  if (kind === "point") return new PointLight(colour, Math.PI * intensity, 0, decay);
  const { angle, penumbra } = cone(cutoff, exponent);
  return new SpotLight(colour, Math.PI * intensity, 0, angle, penumbra, decay);
}

/**
 * Returns the power of the distance that falls as the polynomial of a file does at a distance, in value and slope.
 * @param {[number, number, number]} attenuation
 * @param {number} distanceM
 */
function fall([constant, linear, square], distanceM) {
  const divisor = Math.max(constant + linear * distanceM + square * distanceM ** 2, 1e-6);
  const decay = (linear * distanceM + 2 * square * distanceM ** 2) / divisor;
  return { decay, intensity: distanceM ** decay / divisor };
}

/**
 * Returns the cone of a spot, which fades between two angles. It has half of its light at the same angle as the power of
 * the cosine.
 * @param {number} cutoff
 * @param {number} exponent
 */
function cone(cutoff, exponent) {
  const half = Math.max(0.5 ** (1 / Math.max(exponent, 1e-3)), Math.cos(cutoff));
  if (2 * half - 1 >= Math.cos(cutoff)) return { angle: Math.acos(2 * half - 1), penumbra: 1 };
  return { angle: cutoff, penumbra: 1 - Math.acos(Math.min(2 * half - Math.cos(cutoff), 1)) / cutoff };
}

/**
 * Makes a light cast shadows.
 * @param {DirectionalLight | SpotLight} light
 * @param {boolean} casts
 * @param {number} radiusM
 */
function shadows(light, casts, radiusM) {
  light.castShadow = casts;
  light.shadow.mapSize.set(SHADOW_TEXELS, SHADOW_TEXELS);
  const near = { near: light instanceof DirectionalLight ? 0.5 : 0.05, far: light instanceof DirectionalLight ? 12 : 20 };
  const around = { left: -radiusM, right: radiusM, top: radiusM, bottom: -radiusM };
  Object.assign(light.shadow.camera, near, light instanceof DirectionalLight ? around : {});
  light.shadow.bias = -0.0015;
  light.shadow.normalBias = 0.02;
}

/**
 * Adds the image of a sky around the present camera.
 * @param {Scene} scene
 * @param {import("three").Texture} cube
 */
export function addSky(scene, cube) {
  const material = new ShaderMaterial({
    uniforms: { cube: { value: cube } },
    // The cube's y is up. Source: MuJoCo's `render_gl3.c`.
    vertexShader: `varying vec3 vRay;
      void main() {
        vRay = vec3(position.x, position.z, -position.y);
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
      }`,
    fragmentShader: `uniform samplerCube cube;
      varying vec3 vRay;
      void main() { gl_FragColor = texture(cube, vRay);
        #include <colorspace_fragment>
      }`,
    side: BackSide, depthTest: false, depthWrite: false,
  });
  const sky = new Mesh(new BoxGeometry(SKY_M, SKY_M, SKY_M), material);
  sky.frustumCulled = false;
  sky.matrixAutoUpdate = false;
  sky.matrixWorldAutoUpdate = false;
  sky.renderOrder = -1;
  sky.onBeforeRender = (_renderer, _scene, camera) => { sky.matrixWorld.copyPosition(camera.matrixWorld); };
  scene.add(sky);
}
