// The page at /operate in a headless Chromium: two people start an episode, drive by handles, keys and a gamepad, talk, go away and come
// back, over a quick link and a slow one; how long it takes from a drag to a wrist that moves; and pictures of both pages for somebody to
// look at.
//
//     cargo build --release
//     mkdir -p /tmp/operate && cd /tmp/operate && npm install playwright-core@1.65.1
//     node REPOSITORY/tests/peers/pages/operate.mjs REPOSITORY/target/release/tandem
//
// Takes a chromium from the path, or from CHROMIUM. Pictures are written to the working folder.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { createRequire } from "node:module";
import { connect, createServer } from "node:net";
import { tmpdir } from "node:os";
import { join } from "node:path";

const { chromium } = createRequire(join(process.cwd(), "x"))("playwright-core");
const [program] = process.argv.slice(2);
/** For whoever changes the page: the files of this folder in place of those in the program. */
const sources = process.env.TANDEM_WEB;
const WIDTHS = [400, 1400, 2500];
/** Of a window that nobody looks at: software draws it. */
const SIZE = { width: 800, height: 600 };
/** How long a page may take on a machine that has other things to do. */
const PATIENCE_MS = 120_000;
/** From a drag to a moved wrist on the page, in real time, on this machine. */
const MOST_LATENCY_MS = 120;
/** How long everything takes each way over the slow link. */
const SLOW_LINK_MS = 100;

const runs = mkdtempSync(join(tmpdir(), "operate-"));
const server = spawn(program, ["serve", "--listen", "127.0.0.1:0", "--runs", runs], { stdio: ["ignore", "pipe", "ignore"] });
process.on("exit", () => server.kill());
const base = await new Promise((resolve) => {
  let said = "";
  server.stdout.on("data", (data) => {
    said += data;
    const found = said.match(/watch at (\S+)\n/);
    if (found) resolve(new URL(found[1]).origin);
  });
});
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-background-timer-throttling", "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const complaints = [];

/** Where a row of the socket has a robot's right wrist in its pelvis frame's axes of the room, and when it came; and a gamepad of ours. */
function instrument() {
  window.pad = null;
  navigator.getGamepads = () => (window.pad ? [window.pad] : []);
  window.rows = [];
  window.moves = [];
  addEventListener("pointermove", (event) => window.moves.push(event.timeStamp), true);
  window.WebSocket = class extends WebSocket {
    constructor(...given) {
      super(...given);
      let place = null;
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") return;
        if (!place) {
          const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, new DataView(data).getUint32(0, true))));
          const robot = head.robots.findIndex(({ name }) => name === head.robot);
          const links = head.robots.map(({ links: count }) => 7 * count);
          const before = links.slice(0, robot).reduce((sum, one) => sum + one, 0);
          const parts = head.robots.map(({ joints }) => 1 + 7 + 4 + 46 + joints.length);
          const hands = 5 + links.reduce((sum, one) => sum + one, 0) + 7 * head.objects.length + parts.slice(0, robot).reduce((sum, one) => sum + one, 0) + 12;
          place = { pelvis: 5 + before, wrist: hands + 23, fingers: hands };
          return;
        }
        const row = new Float32Array(data);
        const at = [0, 1, 2].map((axis) => row[place.wrist + axis] - row[place.pelvis + axis]);
        window.rows.push({ came: performance.now(), time_s: row[2], at, drawn: null });
        const own = window.rows.at(-1);
        requestAnimationFrame(() => requestAnimationFrame((now) => { own.drawn = now; }));
        if (window.rows.length > 500) window.rows.shift();
      });
    }
  };
}

/** A person: a browser's context of their own. */
async function person(path, { colorScheme = "light", origin = base } = {}) {
  const context = await browser.newContext({ colorScheme, viewport: SIZE });
  await context.addInitScript(instrument);
  if (sources) {
    // The page itself stays the server's: one that came from elsewhere may open no socket to this machine.
    await context.route("**/operate/page.*", (route) => {
      const name = new URL(route.request().url()).pathname.endsWith("css") ? "style.css" : "dist/page.js";
      return route.fulfill({ path: join(sources, name) });
    });
  }
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (line) => line.text().includes("Content Security Policy") && complaints.push(line.text()));
  await page.goto(new URL(path, origin).href.replace(base, origin));
  return page;
}

async function pictures(page, name) {
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    for (const width of WIDTHS) {
      await page.setViewportSize({ width, height: 1000 });
      await page.screenshot({ path: `${name}-${width}-${colorScheme}.png`, fullPage: true });
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${name} is ${wide} pixels wide in a window of ${width}`);
    }
  }
  await page.setViewportSize(SIZE);
}

const running = (page) => page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: PATIENCE_MS });

const starter = await person("/operate");
await starter.locator("option[value=handover]").waitFor({ state: "attached" });
await starter.locator("select[name=task]").selectOption("handover");
await starter.getByRole("button", { name: "Start" }).click();
const links = starter.getByRole("link", { name: /Drive robot/ });
await links.first().waitFor();
const [a, b] = await links.evaluateAll((found) => found.map((link) => link.getAttribute("href")));
await pictures(starter, "start");

const pageA = await person(a);
await pageA.getByRole("status").filter({ hasText: "waits for robot B" }).waitFor();
let pageB = await person(b);
await Promise.all([running(pageA), running(pageB)]);
assert.ok(!pageA.url().includes("token"), "the token is still in the address");

// A drags its right hand upwards in the picture and closes it; B walks by keys.
const episode = new URLSearchParams(a.split("#")[1]).get("episode");
const stateOf = async (link, robot) => {
  const token = new URLSearchParams(link.split("#")[1]).get("token");
  const headers = { authorization: `Bearer ${token}`, "content-type": "application/json" };
  const body = JSON.stringify({ robot });
  return (await fetch(`${base}/v1/episodes/${episode}/tools/get_robot_state`, { method: "POST", headers, body })).json();
};
const [beforeA, beforeB] = [await stateOf(a, "A"), await stateOf(b, "B")];
const handle = await pageA.getByRole("button", { name: "right wrist: drag" }).boundingBox();
const [x, y] = [handle.x + handle.width / 2, handle.y + handle.height / 2];
await pageA.mouse.move(x, y);
await pageA.mouse.down();
await pageA.mouse.move(x - 40, y - 260, { steps: 12 });
await pageA.mouse.up();
await pageA.keyboard.press("c");
await pageB.keyboard.down("w");
await pageB.waitForTimeout(2000);
await pageB.keyboard.up("w");
await pageA.waitForTimeout(500);
const [afterA, afterB] = [await stateOf(a, "A"), await stateOf(b, "B")];
const movedBy = (from, to) => Math.hypot(...to.position_m.map((value, axis) => value - from.position_m[axis]));
const wristM = movedBy(beforeA.right_wrist, afterA.right_wrist);
const walkedM = movedBy(beforeB.pelvis_in_start, afterB.pelvis_in_start);
console.log(`A's wrist moved ${wristM.toFixed(3)} m, B walked ${walkedM.toFixed(3)} m`);
assert.ok(wristM > 0.05 && walkedM > 0.1);

await pageA.getByLabel("Say to the others").fill("Here it comes <b>now</b>.");
await pageA.getByRole("button", { name: "Say" }).click();
await pageB.getByText("Here it comes <b>now</b>.").waitFor();
await pictures(pageA, "drive");

// B goes away: time stands still. B comes back: it goes on.
await pageB.context().close();
await pageA.getByRole("status").filter({ hasText: "waits for robot B" }).waitFor();
const stood = (await stateOf(a, "A")).time_s;
await pageA.waitForTimeout(1500);
assert.equal((await stateOf(a, "A")).time_s, stood);
pageB = await person(b);
await Promise.all([running(pageA), running(pageB)]);

// Real time, as nearly as this machine draws.
const timeNow = async () => (await stateOf(a, "A")).time_s;
const [clock, simulated] = [performance.now(), await timeNow()];
await pageA.waitForTimeout(4000);
const rate = (await timeNow() - simulated) / ((performance.now() - clock) / 1000);
console.log(`the world runs at ${rate.toFixed(2)} of real time`);
assert.ok(rate <= 1.1 && rate > 0.1, `${rate}`);

/** The times from drags of a person's right handle to a row that has the wrist moved, and to a picture of it, and to its own handle moving. */
async function latencies(page, drags) {
  const found = [];
  // From there the wrist is in sight, wherever it is.
  await page.getByLabel("View").selectOption("free");
  await page.waitForTimeout(500);
  for (let drag = 0; drag < drags; drag += 1) {
    const handle = page.getByRole("button", { name: "right wrist: drag" });
    const box = await handle.boundingBox();
    const [u, v] = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(u, v);
    await page.mouse.down();
    await page.evaluate(() => {
      const before = window.rows.at(-1).at;
      window.moves.length = 0;
      const own = document.querySelector(".handle.right");
      const place = own.style.left + own.style.top;
      window.measured = new Promise((done, failed) => {
        let handleMs = null;
        setTimeout(() => failed(new Error("nothing has moved for ten seconds")), 10_000);
        const look = () => {
          const [begun] = window.moves;
          if (begun && handleMs === null && own.style.left + own.style.top !== place) handleMs = performance.now() - begun;
          const moved = begun && window.rows.find((row) => row.came > begun && row.drawn && Math.hypot(...row.at.map((value, axis) => value - before[axis])) > 0.003);
          if (moved && handleMs !== null) done({ rowMs: moved.came - begun, drawnMs: moved.drawn - begun, handleMs });
          else requestAnimationFrame(look);
        };
        look();
      });
    });
    // To and fro, so that the wrist stays where it can go.
    await page.mouse.move(u + (drag % 2 ? 30 : -30), v);
    found.push(await page.evaluate(() => window.measured));
    await page.mouse.up();
    await page.waitForTimeout(700);
  }
  const median = (values) => values.sort((one, other) => one - other)[Math.floor(values.length / 2)];
  return Object.fromEntries(["rowMs", "drawnMs", "handleMs"].map((name) => [name, median(found.map((one) => one[name]))]));
}

const quick = await latencies(pageA, 15);
console.log(`from a drag to the wrist that moves: its row ${quick.rowMs.toFixed(0)} ms, its picture ${quick.drawnMs.toFixed(0)} ms, the handle ${quick.handleMs.toFixed(0)} ms (medians)`);
if (!process.env.UNTIMED) assert.ok(quick.drawnMs < MOST_LATENCY_MS, `${quick.drawnMs} ms`);

// A gamepad: a stick walks, a trigger closes, a bumper lets go.
const withPad = (page, axes, buttons) => page.evaluate(([some, values]) => {
  window.pad = { connected: true, axes: some, buttons: values.map((value) => ({ value, pressed: value > 0.5 })) };
}, [axes, Array.from({ length: 17 }, (_, index) => buttons[index] ?? 0)]);
const resting = await stateOf(b, "B");
await withPad(pageB, [0, -1, 0, 0], { 7: 1 });
await pageB.waitForTimeout(2500);
await withPad(pageB, [0, 0, 0, 0], { 7: 1 });
await pageB.waitForTimeout(800);
const gone = await stateOf(b, "B");
console.log(`by a gamepad B walked ${movedBy(resting.pelvis_in_start, gone.pelvis_in_start).toFixed(3)} m`);
assert.ok(movedBy(resting.pelvis_in_start, gone.pelvis_in_start) > 0.1);
// The last seven joints are those of the right hand: thumb, middle, index.
const fingers = (state) => state.joint_positions_rad.slice(-7);
const closed = fingers(gone).map((value, joint) => Math.abs(value - fingers(resting)[joint]));
assert.ok(Math.max(...closed) > 0.3, `the trigger closes nothing: ${closed}`);
const targetOf = (page) => page.locator(".handle.right").evaluate((handle) => handle.style.left + handle.style.top);
await withPad(pageA, [0, 0, 0, 0], { 5: 1 });
await pageA.waitForTimeout(300);
await withPad(pageA, [0, 0, 0, 0], {});
assert.ok(await targetOf(pageA));

// Step by step: time passes only when it is asked for.
await pageA.getByLabel("step by step").check();
await pageA.waitForTimeout(600);
const waited = (await stateOf(a, "A")).time_s;
await pageA.waitForTimeout(600);
assert.equal((await stateOf(a, "A")).time_s, waited);
await pageA.getByRole("button", { name: "Step (Enter)" }).click();
await pageA.waitForTimeout(1500);
const stepped = (await stateOf(a, "A")).time_s - waited;
assert.ok(Math.abs(stepped - 0.2) < 0.03, `a step is ${stepped} s`);
await pageA.getByLabel("step by step").uncheck();

await pageA.screenshot({ path: "drive-free.png" });

// A link on which everything takes 100 ms each way: the handle is where the person has it at once, and the wrist follows.
const slow = createServer((near) => {
  const far = connect(new URL(base).port, "127.0.0.1");
  const pass = (from, to) => from.on("data", (data) => setTimeout(() => to.writable && to.write(data), SLOW_LINK_MS)).on("close", () => setTimeout(() => to.end(), SLOW_LINK_MS)).on("error", () => to.destroy());
  pass(near, far);
  pass(far, near);
});
await new Promise((done) => slow.listen(0, "127.0.0.1", done));
await pageA.context().close();
const slowA = await person(a, { origin: `http://127.0.0.1:${slow.address().port}` });
await running(slowA);
const late = await latencies(slowA, 9);
console.log(`over ${SLOW_LINK_MS} ms each way: its row ${late.rowMs.toFixed(0)} ms, its picture ${late.drawnMs.toFixed(0)} ms, the handle ${late.handleMs.toFixed(0)} ms`);
assert.ok(late.rowMs > 2 * SLOW_LINK_MS && late.handleMs < MOST_LATENCY_MS, JSON.stringify(late));

// A forged link drives nothing.
const forged = await person(a.replace(/token=[^&]*/, "token=0123456789abcdef0123456789abcdef01234567"));
await forged.getByRole("heading", { name: "Nothing to drive" }).waitFor();
assert.equal(await forged.getByRole("status").count(), 0, "a forged link drives");

await browser.close();
slow.close();
await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" });
const recording = join(runs, episode, "episode.mcap");
console.log(execFileSync(program, ["replay", recording, "--verify"], { encoding: "utf8" }).trim());
assert.deepEqual(complaints, []);
console.log("as it should be");
process.exit(0);
