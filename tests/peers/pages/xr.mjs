// The page at /operate in an emulated Quest 3 (npm's iwer, in a headless Chromium): robot A's person wears it, moves both wrists by
// squeezed controllers, walks by a stick, brings the right hand to the bottle, closes it by the trigger, lifts; then with tracked hands,
// whose fingers the robot's follow; and pictures of what the headset shows. How it is run is said in shared/browser.mjs.
import { execFileSync } from "node:child_process";
import { createRequire } from "node:module";
import { join } from "node:path";
import { PATIENCE_MS, done, open, post, program, serve, until } from "./shared/browser.mjs";
import { apart, hear, poses } from "./shared/rows.mjs";

const iwer = { path: createRequire(import.meta.url).resolve("iwer/build/iwer.min.js") };

const { base, runs } = await serve("--renderer", "cpu");
const started = await post(base, "/v1/episodes", { task: "handover", seed: 2000, operators: "per_robot", patience_s: 600 });
const { episode_id: episode, operators: [{ token }, { token: still }] } = started;
const link = `/operate#${new URLSearchParams({ episode, robot: "A", token, still: `B.${still}` })}`;

/** Puts a headset on. */
function wear() {
  const device = new window.IWER.XRDevice(window.IWER.metaQuest3);
  device.installRuntime({ forceInstall: true });
  device.stereoEnabled = true;
  window.device = device;
  // Where the processor draws, a picture takes longer than all that is tried here, so that only those are drawn that are kept.
  for (const name of ["drawArrays", "drawElements"]) {
    const draw = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...given) {
      if (window.drawing) draw.apply(this, given);
    };
  }
}
const page = await open(base + link, { viewport: { width: 480, height: 300 }, before: [hear, iwer, wear] });
await page.getByRole("button", { name: "Enter VR" }).waitFor();
// A click of the mouse would first wait for the picture to be still.
await page.getByRole("button", { name: "Enter VR" }).dispatchEvent("click");
await page.waitForFunction(() => window.rows.length > 0 && window.device.activeSession);

/** A way or a turn of the pelvis frame (x ahead, y left, z up) as the headset has it (x right, y up, z back). */
const inHeadset = ([x, y, z]) => [-y, z, -x];
const state = () => poses(page);
const controls = {};
/** Moves and turns a controller from where its squeeze began, a little at a time, as an arm does. */
async function move(side, way, turn = [1, 0, 0, 0], ms = 1500) {
  controls[side] ??= { way: [0, 0, 0], turn: [1, 0, 0, 0] };
  const from = controls[side];
  for (let step = 1; step <= 15; step += 1) {
    const share = step / 15;
    const now = from.way.map((value, axis) => value + share * (way[axis] - value));
    const blend = from.turn.map((value, axis) => value + share * (turn[axis] - value));
    const norm = Math.hypot(...blend);
    await page.evaluate(([name, [x, y, z], [w, i, j, k]]) => {
      const controller = window.device.controllers[name];
      const home = name === "left" ? -0.2 : 0.2;
      controller.position.set(home + x, 1.2 + y, -0.3 + z);
      controller.quaternion.set(i, j, k, w);
    }, [side, inHeadset(now), [blend[0], ...inHeadset(blend.slice(1))].map((value) => value / norm)]);
    await page.waitForTimeout(ms / 15);
  }
  controls[side] = { way, turn };
}
/** Keeps what the headset shows. */
async function picture(path) {
  await page.evaluate(() => new Promise((drawn) => {
    window.drawing = true;
    requestAnimationFrame(() => requestAnimationFrame(() => requestAnimationFrame(drawn)));
  }));
  await page.screenshot({ path });
  await page.evaluate(() => { window.drawing = false; });
}
const press = (side, button, value) => page.evaluate(([name, what, how]) => window.device.controllers[name].updateButtonValue(what, how), [side, button, value]);

/** Waits until a wrist is within 3 cm of a place in the pelvis frame, or goes no nearer for two seconds of the world's time. */
async function arrive(side, goal) {
  let best = { distance: Infinity, time_s: 0 };
  const deadline = performance.now() + PATIENCE_MS;
  while (performance.now() < deadline) {
    const now = await state();
    const distance = apart(now[side].position, goal);
    if (distance < best.distance - 0.002) best = { distance, time_s: now.time_s };
    if (distance < 0.03 || now.time_s > best.time_s + 2) return;
    await page.waitForTimeout(250);
  }
}

for (const side of ["left", "right"]) await move(side, [0, 0, 0], undefined, 100);
const before = await state();
for (const side of ["left", "right"]) await press(side, "squeeze", 1);
// The squeeze has to be seen before its controller goes.
await page.evaluate(async () => {
  for (let frame = 0; frame < 3; frame += 1) await new Promise((drawn) => { window.device.activeSession.requestAnimationFrame(drawn); });
});
await Promise.all([move("left", [0.05, 0, 0.1]), move("right", [0.05, 0, 0.1])]);
for (const side of ["left", "right"]) {
  await until(`the ${side} wrist moved [m]`, async () => apart(before[side].position, (await state())[side].position), 0.06);
}
await picture("xr-wrists.png");
await press("left", "squeeze", 0);

// To the bottle from the side, palm first and above the table; then the trigger closes.
const { objects: { bottle } } = await state();
const home = before.right.position;
const upright = [before.right.turn[0], ...before.right.turn.slice(1).map((value) => -value)];
const besides = (from) => bottle.position.map((value, axis) => value + from[axis]);
const reach = async (from, ms) => {
  await move("right", besides(from).map((value, axis) => value - home[axis]), upright, ms);
  await arrive("right", besides(from));
};
await press("right", "trigger", 0.1);
await reach([-0.12, -0.135, 0.12], 2500);
await reach([-0.12, -0.135, 0.055], 1500);
await reach([-0.12, -0.06, 0.055], 1500);
const near = await state();
console.log(`before it closes, the wrist is ${near.right.position.map((value, axis) => (value - near.objects.bottle.position[axis]).toFixed(3)).join(", ")} m from the bottle`);
await picture("xr-grasp.png");
await press("right", "trigger", 1);
await until("the right hand feels what it touches [N]", async () => (await state()).contact_n, 1);
await reach([-0.12, -0.06, 0.155], 2000);
await until("the bottle went up [m]", async () => (await state()).objects.bottle.position[2] - near.objects.bottle.position[2], 0.03);
await picture("xr-lift.png");

// A button lowers the robot, a stick walks.
await press("right", "squeeze", 0);
const lifted = await state();
await press("right", "a-button", 1);
await until("it went down [m]", async () => lifted.pelvis.position[2] - (await state()).pelvis.position[2], 0.02);
await press("right", "a-button", 0);
await page.evaluate(() => window.device.controllers.left.updateAxes("thumbstick", 0, 1));
await until("it walked [m]", async () => apart(lifted.pelvis.position.slice(0, 2), (await state()).pelvis.position.slice(0, 2)), 0.1);
await page.evaluate(() => window.device.controllers.left.updateAxes("thumbstick", 0, 0));

// Tracked hands: those of the robot follow a pinch.
const fingersOf = async () => {
  const { joint_positions_rad: joints } = await post(base, `/v1/episodes/${episode}/tools/get_robot_state`, { robot: "A" }, token);
  return Object.keys(joints).filter((name) => name.startsWith("left_hand")).map((name) => joints[name]);
};
const atRest = await fingersOf();
await page.evaluate(() => {
  window.device.primaryInputMode = "hand";
  window.device.hands.left.poseId = "pinch";
  window.device.hands.left.updatePinchValue(1);
});
await until("a finger of the left hand turned [rad]", async () => Math.max(...(await fingersOf()).map((value, joint) => Math.abs(value - atRest[joint]))), 0.2);
await picture("xr-hands.png");

await page.evaluate(() => window.device.activeSession.end());
await page.waitForFunction(() => !window.device.activeSession);
await picture("xr-left.png");
await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" });
console.log(execFileSync(program, ["replay", join(runs, episode, "episode.mcap"), "--verify"], { encoding: "utf8" }).trim());
await done();
