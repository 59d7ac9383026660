// The page at /operate in an emulated Quest 3 (npm's iwer, in a headless Chromium): robot A's person wears it, moves both wrists by
// squeezed controllers, walks by a stick, brings the right hand to the bottle, closes it by the trigger, lifts; then with tracked hands,
// whose fingers the robot's follow; and a picture of what the headset shows.
//
//     cargo build --release
//     mkdir -p /tmp/xr && cd /tmp/xr && npm install playwright-core@1.65.1 iwer@2.5.0
//     node REPOSITORY/tests/peers/pages/xr.mjs REPOSITORY/target/release/tandem
//
// Takes a chromium from the path, or from CHROMIUM. Pictures are written to the working folder.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const require = createRequire(join(process.cwd(), "x"));
const { chromium } = require("playwright-core");
const [program] = process.argv.slice(2);
/** How long a machine that draws by its processor may take for anything. */
const SLOW_MS = 120_000;

const runs = mkdtempSync(join(tmpdir(), "xr-"));
const server = spawn(program, ["serve", "--listen", "127.0.0.1:0", "--runs", runs, "--renderer", "cpu"], { stdio: ["ignore", "pipe", "ignore"] });
process.on("exit", () => server.kill());
const base = await new Promise((resolve) => {
  let said = "";
  server.stdout.on("data", (data) => {
    said += data;
    const found = said.match(/watch at (\S+)\n/);
    if (found) resolve(new URL(found[1]).origin);
  });
});
const post = async (path, body, token) => {
  const headers = { "content-type": "application/json", ...(token ? { authorization: `Bearer ${token}` } : {}) };
  return (await fetch(base + path, { method: "POST", headers, body: JSON.stringify(body) })).json();
};
const started = await post("/v1/episodes", { task: "handover", seed: 2000, operators: "per_robot", patience_s: 600 });
const { episode_id: episode, operators: [{ token }, { token: still }] } = started;
const link = `/operate#${new URLSearchParams({ episode, robot: "A", token, still: `B.${still}` })}`;

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-background-timer-throttling", "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const complaints = [];
const context = await browser.newContext({ viewport: { width: 480, height: 300 } });
context.setDefaultTimeout(SLOW_MS);
await context.addInitScript({ path: join(process.cwd(), "node_modules/iwer/build/iwer.min.js") });
await context.addInitScript(() => {
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
  window.WebSocket = class extends WebSocket {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") return;
        if (window.head) window.row = [...new Float32Array(data)];
        else window.head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, new DataView(data).getUint32(0, true))));
      });
    }
  };
});
const page = await context.newPage();
page.on("pageerror", (error) => complaints.push(error.message));
page.on("console", (line) => line.text().includes("Content Security Policy") && complaints.push(line.text()));
await page.goto(base + link);
await page.getByRole("button", { name: "Enter VR" }).waitFor();
// A click of the mouse would first wait for the picture to be still.
await page.getByRole("button", { name: "Enter VR" }).dispatchEvent("click");
await page.waitForFunction(() => window.row && window.device.activeSession);

// Turns and ways of the robot's pelvis: x ahead, y left, z up; of the headset: x right, y up, z back.
const times = ([a, b, c, d], [e, f, g, h]) => [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
const turned = (q, [x, y, z]) => times(times(q, [0, x, y, z]), [q[0], -q[1], -q[2], -q[3]]).slice(1);
const inHeadset = ([x, y, z]) => [-y, z, -x];

/**
 * Poses in A's pelvis frame of its wrists and of the bottle, and the force on what its right hand touches, as the newest row has them;
 * quaternions are w, x, y, z.
 */
const poses = async () => {
  const { row, head } = await page.evaluate(() => ({ row: window.row, head: window.head }));
  const links = head.robots.map((robot) => 7 * robot.links);
  const objects = 5 + links.reduce((sum, one) => sum + one, 0);
  const hands = objects + 7 * head.objects.length + 12;
  const read = (at) => ({ position: row.slice(at, at + 3), turn: [row[at + 6], row[at + 3], row[at + 4], row[at + 5]] });
  const pelvis = read(5);
  const back = [pelvis.turn[0], ...pelvis.turn.slice(1).map((value) => -value)];
  const local = ({ position, turn }) => ({ position: turned(back, position.map((value, axis) => value - pelvis.position[axis])), turn: times(back, turn) });
  return { pelvis, left: local(read(hands)), right: local(read(hands + 23)), bottle: local(read(objects + 7 * head.objects.indexOf("bottle"))), time_s: row[2], contact_n: Math.hypot(...row.slice(hands + 43, hands + 46)) };
};
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
const apart = (one, other) => Math.hypot(...one.map((value, axis) => value - other[axis]));

/** Waits until something is as it should be, and says what it came to. */
async function until(what, measure, least) {
  const deadline = performance.now() + SLOW_MS;
  for (;;) {
    const value = await measure();
    if (value >= least || performance.now() > deadline) {
      console.log(`${what}: ${value.toFixed(3)}`);
      assert.ok(value >= least, what);
      return;
    }
    await page.waitForTimeout(250);
  }
}

/** Waits until a wrist is within 3 cm of a place in the pelvis frame, or goes no nearer for two seconds of the world's time. */
async function arrive(side, goal) {
  let best = { distance: Infinity, time_s: 0 };
  const deadline = performance.now() + SLOW_MS;
  while (performance.now() < deadline) {
    const now = await poses();
    const distance = apart(now[side].position, goal);
    if (distance < best.distance - 0.002) best = { distance, time_s: now.time_s };
    if (distance < 0.03 || now.time_s > best.time_s + 2) return;
    await page.waitForTimeout(250);
  }
}

for (const side of ["left", "right"]) await move(side, [0, 0, 0], undefined, 100);
const before = await poses();
for (const side of ["left", "right"]) await press(side, "squeeze", 1);
// The squeeze has to be seen before its controller goes.
await page.waitForTimeout(2000);
await Promise.all([move("left", [0.05, 0, 0.1]), move("right", [0.05, 0, 0.1])]);
for (const side of ["left", "right"]) {
  await until(`the ${side} wrist moved [m]`, async () => apart(before[side].position, (await poses())[side].position), 0.06);
}
await picture("xr-wrists.png");
await press("left", "squeeze", 0);

// To the bottle from the side, palm first; then the trigger closes.
const { bottle } = await poses();
const home = before.right.position;
const upright = [before.right.turn[0], ...before.right.turn.slice(1).map((value) => -value)];
const besides = (from) => bottle.position.map((value, axis) => value + from[axis]);
const reach = async (from, ms) => {
  await move("right", besides(from).map((value, axis) => value - home[axis]), upright, ms);
  await arrive("right", besides(from));
};
await press("right", "trigger", 0.1);
await reach([-0.12, -0.135, 0.12], 2500);
await reach([-0.12, -0.135, 0], 1500);
await reach([-0.12, -0.055, 0], 1500);
const near = await poses();
console.log(`before it closes, the wrist is ${near.right.position.map((value, axis) => (value - near.bottle.position[axis]).toFixed(3)).join(", ")} m from the bottle`);
await picture("xr-grasp.png");
await press("right", "trigger", 1);
await until("the right hand feels what it touches [N]", async () => (await poses()).contact_n, 1);
await reach([-0.12, -0.055, 0.1], 2000);
await until("the bottle went up [m]", async () => (await poses()).bottle.position[2] - near.bottle.position[2], 0.03);
await picture("xr-lift.png");

// A button lowers the robot, a stick walks.
await press("right", "squeeze", 0);
const lifted = await poses();
await press("right", "a-button", 1);
await until("it went down [m]", async () => lifted.pelvis.position[2] - (await poses()).pelvis.position[2], 0.02);
await press("right", "a-button", 0);
await page.evaluate(() => window.device.controllers.left.updateAxes("thumbstick", 0, 1));
await until("it walked [m]", async () => apart(lifted.pelvis.position.slice(0, 2), (await poses()).pelvis.position.slice(0, 2)), 0.1);
await page.evaluate(() => window.device.controllers.left.updateAxes("thumbstick", 0, 0));

// Tracked hands: those of the robot follow a pinch.
const fingersOf = async () => (await post(`/v1/episodes/${episode}/tools/get_robot_state`, { robot: "A" }, token)).joint_positions_rad.slice(22, 29);
const open = await fingersOf();
await page.evaluate(() => {
  window.device.primaryInputMode = "hand";
  window.device.hands.left.poseId = "pinch";
  window.device.hands.left.updatePinchValue(1);
});
await until("a finger of the left hand turned [rad]", async () => Math.max(...(await fingersOf()).map((value, joint) => Math.abs(value - open[joint]))), 0.2);
await picture("xr-hands.png");

await page.evaluate(() => window.device.activeSession.end());
await page.waitForFunction(() => !window.device.activeSession);
await picture("xr-left.png");
await browser.close();
await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" });
console.log(execFileSync(program, ["replay", join(runs, episode, "episode.mcap"), "--verify"], { encoding: "utf8" }).trim());
assert.deepEqual(complaints, []);
console.log("as it should be");
process.exit(0);
