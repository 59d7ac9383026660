// The page at /operate in a headless Chromium: two people start an episode, drive by handles, keys, a gamepad and fingers on a
// telephone, talk, leave and return, grasp the bottle and lift it. shared/browser.mjs describes how to run it.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { PATIENCE_MS, accessible, done, open, post, program, serve, until } from "./shared/browser.mjs";
import { hear, inPages, poses } from "./shared/rows.mjs";

const { base, runs } = await serve();

/** A simulated gamepad. */
function pad() {
  window.pad = null;
  navigator.getGamepads = () => (window.pad ? [/** @type {Gamepad} */ (window.pad)] : []);
}

/** A person with a separate browser context. */
const person = (path, device) => open(new URL(path, base).href, { before: [hear, pad, inPages], ...device });
const TELEPHONE = { viewport: { width: 400, height: 800 }, deviceScaleFactor: 2, hasTouch: true, isMobile: true };

const running = (page) => page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: PATIENCE_MS });

const starter = await person("/operate");
await starter.locator("option[value=handover]").waitFor({ state: "attached" });
await starter.locator("select[name=task]").selectOption("handover");
await starter.getByRole("button", { name: "Start" }).click();
const links = starter.getByRole("link", { name: /Drive robot/ });
await links.first().waitFor();
const [a, b] = await links.evaluateAll((found) => found.map((link) => link.getAttribute("href")));
await accessible(starter, "the start");

const pageA = await person(a);
await pageA.getByRole("status").filter({ hasText: "waits for robot B" }).waitFor();
let pageB = await person(b);
await Promise.all([running(pageA), running(pageB)]);
assert.ok(!pageA.url().includes("token"), "the token is still in the address");

// Hanging hands are below the robot's picture, and their handles are visible. The phases are listed.
const insideBy = (page, side) => page.locator(`.handle.${side}`).evaluate((handle) => {
  const [own, place] = [handle, document.querySelector(".operate-view")].map((one) => one.getBoundingClientRect());
  return Math.min(own.left - place.left, place.right - own.right, own.top - place.top, place.bottom - own.bottom);
});
for (const side of ["left", "right"]) await until(`pixels from the ${side} handle to the border`, () => insideBy(pageA, side), 20);
assert.deepEqual(await pageA.locator(".phases li > :last-child").allInnerTexts(), ["not yet", "not yet", "not yet"]);

const withPad = (page, axes, buttons) => page.evaluate(([some, values]) => {
  window.pad = { connected: true, axes: some, buttons: values.map((value) => ({ value, pressed: value > 0.5 })) };
}, [axes, Array.from({ length: 17 }, (_, index) => buttons[index] ?? 0)]);
// A takes the bottle while B waits: keys move the level, open hand beside it, the gamepad's trigger closes the hand, and keys lift it.
await pageA.keyboard.press("2");
for (const key of [" ", "h", "o"]) await pageA.keyboard.press(key);
/** Waits until this simulated time has passed, which takes longer on a slow machine. */
const worldPasses = async (seconds) => {
  const { time_s: from } = await poses(pageA);
  await pageA.waitForFunction((until) => window.rows.at(-1).row[2] >= until, from + seconds);
};
/**
 * Brings the right wrist to a place beside the bottle, along the axes of the pelvis frame: keys are held for the time that most of
 * the way takes, and again once the wrist has reached its target.
 */
const reach = (offset) => pageA.evaluate(async ([goal, patienceMs]) => {
  const KEYS = [["ArrowUp", "ArrowDown"], ["ArrowLeft", "ArrowRight"], ["PageUp", "PageDown"]];
  const [KEY_M_S, SHARE, NEAR_M, STILL_M, STILL_S] = [0.2, 0.8, 0.012, 0.003, 0.3];
  const passed = (ms) => new Promise((done) => setTimeout(done, ms));
  const now = () => window.posesIn(window.head, window.rows.at(-1).row);
  const hold = async (key, ms) => {
    dispatchEvent(new KeyboardEvent("keydown", { key }));
    await passed(ms);
    dispatchEvent(new KeyboardEvent("keyup", { key }));
  };
  const comeToRest = async () => {
    for (let from = now(); ;) {
      await passed(50);
      const { right, time_s: time } = now();
      const moved = Math.max(...right.position.map((value, axis) => Math.abs(value - from.right.position[axis])));
      if (moved > STILL_M) from = now();
      else if (time > from.time_s + STILL_S) return;
    }
  };
  let missing = [];
  for (const began = performance.now(); performance.now() - began < patienceMs;) {
    await comeToRest();
    const { right, objects: { bottle } } = now();
    missing = goal.map((value, axis) => bottle.position[axis] + value - right.position[axis]);
    const ways = missing.map((value, axis) => ({ key: KEYS[axis][value > 0 ? 0 : 1], way: Math.abs(value) }));
    const far = ways.filter(({ way }) => way > NEAR_M);
    if (far.length === 0) return;
    await Promise.all(far.map(({ key, way }) => hold(key, 1000 * SHARE * Math.min(way, 0.15) / KEY_M_S)));
  }
  throw new Error(`the wrist is still ${missing.map((value) => value.toFixed(3)).join(", ")} m away`);
}, [offset, PATIENCE_MS]);
await worldPasses(1);
await reach([-0.12, -0.135, 0.12]);
await reach([-0.12, -0.135, 0.055]);
await reach([-0.12, -0.06, 0.055]);
const near = await poses(pageA);
console.log(`before it closes, the wrist is ${near.right.position.map((value, axis) => (value - near.objects.bottle.position[axis]).toFixed(3)).join(", ")} m from the bottle, turned ${near.right.turn.map((value) => value.toFixed(2)).join(", ")}`);
await pageA.screenshot({ path: "drive-grasp.png" });
await withPad(pageA, [0, 0, 0, 0], { 7: 1 });
await worldPasses(2);
await pageA.keyboard.down("PageUp");
await pageA.getByText("reached: grasp and lift").waitFor().catch(async (error) => {
  const { right, objects: { bottle }, contact_n: contact } = await poses(pageA);
  console.log(`the wrist is ${right.position.map((value, axis) => (value - bottle.position[axis]).toFixed(3)).join(", ")} m from the bottle and feels ${contact.toFixed(1)} N`);
  throw error;
});
await pageA.keyboard.up("PageUp");
await pageA.screenshot({ path: "drive-lift.png" });
console.log("the first phase is reached");
await pageA.evaluate(() => { window.pad = null; });
await pageA.locator(".phases .done", { hasText: "p1 grasp and lift" }).waitFor();

// A drags its right hand upwards in the picture and closes it; B walks by keys.
const episode = new URLSearchParams(a.split("#")[1]).get("episode");
const stateOf = (link, robot) =>
  post(base, `/v1/episodes/${episode}/tools/get_robot_state`, { robot }, new URLSearchParams(link.split("#")[1]).get("token"));
const movedBy = (from, to) => Math.hypot(...to.position_m.map((value, axis) => value - from.position_m[axis]));
const [beforeA, beforeB] = [await stateOf(a, "A"), await stateOf(b, "B")];
const handle = await pageA.getByRole("button", { name: "right wrist: drag" }).boundingBox();
const [x, y] = [handle.x + handle.width / 2, handle.y + handle.height / 2];
await pageA.mouse.move(x, y);
await pageA.mouse.down();
await pageA.mouse.move(x - 40, y - 260, { steps: 12 });
await pageA.mouse.up();
await pageA.keyboard.press("c");
await pageB.keyboard.down("w");
const walkedM = async (from) => movedBy(from.pelvis_in_start, (await stateOf(b, "B")).pelvis_in_start);
await until("A's wrist moved [m]", async () => movedBy(beforeA.right_wrist, (await stateOf(a, "A")).right_wrist), 0.05);
await until("B walked [m]", () => walkedM(beforeB), 0.1);
await pageB.keyboard.up("w");

await pageA.getByLabel("Say to the others").fill("Here it comes <b>now</b>.");
await pageA.getByRole("button", { name: "Say" }).click();
await pageB.getByText("Here it comes <b>now</b>.").waitFor();
await accessible(pageA, "who drives");

// While B is away, time is paused. It continues when B returns.
await pageB.context().close();
await pageA.getByRole("status").filter({ hasText: "waits for robot B" }).waitFor();
const stood = (await stateOf(a, "A")).time_s;
await pageA.waitForTimeout(1500);
assert.equal((await stateOf(a, "A")).time_s, stood);
pageB = await person(b);
await Promise.all([running(pageA), running(pageB)]);

// The episode runs in real time, as far as this machine can draw it.
const timeNow = async () => (await stateOf(a, "A")).time_s;
const [clock, simulated] = [performance.now(), await timeNow()];
await worldPasses(2);
const rate = (await timeNow() - simulated) / ((performance.now() - clock) / 1000);
console.log(`the world runs at ${rate.toFixed(2)} of real time`);
assert.ok(rate <= 1.1, `${rate}`);

// On the gamepad a stick walks, a trigger closes the hand, and a bumper releases the arms.
const resting = await stateOf(b, "B");
await withPad(pageB, [0, -1, 0, 0], { 7: 1 });
await until("by a gamepad B walked [m]", () => walkedM(resting), 0.1);
await withPad(pageB, [0, 0, 0, 0], { 7: 1 });
const fingers = ({ joint_positions_rad: joints }) => Object.keys(joints).filter((name) => name.startsWith("right_hand")).map((name) => joints[name]);
const closedRad = async () => Math.max(...fingers(await stateOf(b, "B")).map((value, joint) => Math.abs(value - fingers(resting)[joint])));
await until("the trigger turned a finger [rad]", closedRad, 0.3);
const targetOf = (page) => page.locator(".handle.right").evaluate((handle) => handle.style.transform);
await withPad(pageA, [0, 0, 0, 0], { 5: 1 });
await pageA.waitForTimeout(300);
await withPad(pageA, [0, 0, 0, 0], {});
assert.ok(await targetOf(pageA));

// B continues on a telephone: one thumb walks, then turns, while a finger drags a hand. The page does not scroll.
await pageB.context().close();
pageB = await person(b, TELEPHONE);
await Promise.all([running(pageA), running(pageB)]);
await accessible(pageB, "who drives by a telephone");
assert.equal(await pageB.evaluate(() => document.documentElement.scrollWidth), TELEPHONE.viewport.width);
const screen = await pageB.context().newCDPSession(pageB);
const fingersAre = (type, ...touchPoints) => screen.send("Input.dispatchTouchEvent", { type, touchPoints });
const middleOf = async (id, selector) => {
  const { x: left, y: top, width, height } = await pageB.locator(selector).boundingBox();
  assert.ok(Math.min(width, height) >= 44, `${selector} is ${width} by ${height} pixels`);
  return { id, x: left + width / 2, y: top + height / 2 };
};
const [thumb, round, finger] = [await middleOf(0, ".pad.walk"), await middleOf(1, ".pad.turn"), await middleOf(2, ".handle.left")];
const shifted = (point, right, down) => ({ ...point, x: point.x + right, y: point.y + down });
const standing = await stateOf(b, "B");
await fingersAre("touchStart", thumb);
await fingersAre("touchMove", shifted(thumb, 0, 50));
await until("by a thumb B walked [m]", () => walkedM(standing), 0.1);
await fingersAre("touchEnd");
const [halfTurn, reached] = await stateOf(b, "B").then(({ pelvis_in_start: pelvis, left_wrist: wrist }) => [pelvis.quaternion_wxyz, wrist]);
await fingersAre("touchStart", shifted(round, -50, 0));
await fingersAre("touchStart", shifted(round, -50, 0), finger);
for (let step = 1; step <= 10; step += 1) await fingersAre("touchMove", shifted(round, -50, 0), shifted(finger, 0, -12 * step));
const turnedRad = async () => {
  const { quaternion_wxyz: turn } = (await stateOf(b, "B")).pelvis_in_start;
  return 2 * Math.acos(Math.min(1, Math.abs(turn.reduce((sum, value, axis) => sum + value * halfTurn[axis], 0))));
};
await until("by a thumb B turned [rad]", turnedRad, 0.3);
await until("by a finger B's left wrist moved [m]", async () => movedBy(reached, (await stateOf(b, "B")).left_wrist), 0.05);
await pageB.screenshot({ path: "drive-telephone.png" });
await fingersAre("touchEnd");
assert.deepEqual(await pageB.evaluate(() => [scrollX, scrollY, visualViewport.scale]), [0, 0, 1], "a finger moved the page");
assert.equal(await pageB.locator(".pad .knob").first().evaluate((knob) => knob.style.transform), "translate(0%, 0%)");

// In the stepwise mode time passes only on request.
/** Returns the simulated time once it is paused. */
const stands = async () => {
  for (let [before, now] = [null, await timeNow()]; ; [before, now] = [now, await timeNow()]) {
    if (now === before) return now;
    await pageA.waitForTimeout(1000);
  }
};
await pageA.getByLabel("step by step").check();
const waited = await stands();
await pageA.getByRole("button", { name: "Step (Enter)" }).click();
await pageA.waitForFunction((from) => window.rows.at(-1).row[2] > from + 0.01, waited);
const stepped = await stands() - waited;
assert.ok(Math.abs(stepped - 0.2) < 0.03, `a step is ${stepped} s`);
await pageA.getByLabel("step by step").uncheck();

await pageA.screenshot({ path: "drive-free.png" });

// A forged link cannot drive a robot.
const forged = await person(a.replace(/token=[^&]*/, "token=0123456789abcdef0123456789abcdef01234567"));
await forged.getByRole("heading", { name: "Nothing to drive" }).waitFor();
assert.equal(await forged.getByRole("status").count(), 0, "a forged link drives");

// The episode ends, and both pages show its outcome and its address.
await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" });
for (const page of [pageA, pageB]) {
  await page.getByText("The episode has ended").waitFor();
  assert.equal(await page.getByRole("link", { name: "Look at it again" }).getAttribute("href"), `/watch?run=${episode}`);
  assert.equal(await page.locator("button:visible").count(), 0, "there is still something to press");
}
assert.match(await pageA.locator(".phases").innerText(), /p1 grasp and lift[^]*\d s[^]*p2 transfer[^]*not reached/);
await accessible(pageA, "an episode that is over");
// After a change of the window's size the scene is drawn again.
await pageA.setViewportSize({ width: 900, height: 700 });
await until("bytes of the end's picture", async () => (await pageA.locator(".view canvas").screenshot()).length, 20_000);
const recording = join(runs, episode, "episode.mcap");
console.log(execFileSync(program, ["replay", recording, "--verify"], { encoding: "utf8" }).trim());
await done();
