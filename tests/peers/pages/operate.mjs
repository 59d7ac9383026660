// The page at /operate in a headless Chromium: two people start an episode, drive by handles and keys, talk, go away and come back;
// and pictures of both pages for somebody to look at.
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
import { tmpdir } from "node:os";
import { join } from "node:path";

const { chromium } = createRequire(join(process.cwd(), "x"))("playwright-core");
const [program] = process.argv.slice(2);
/** For whoever changes the page: the files of this folder in place of those in the program. */
const sources = process.env.TANDEM_WEB;
const WIDTHS = [400, 1400, 2500];

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
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
const complaints = [];

/** A person: a browser's context of their own. */
async function person(path, colorScheme = "light") {
  const context = await browser.newContext({ colorScheme, viewport: { width: 1400, height: 1000 } });
  if (sources) {
    await context.route(/\/operate(\/.*)?$/, (route) => {
      const name = new URL(route.request().url()).pathname.replace(/^\/operate\/?/, "");
      return route.fulfill({ path: join(sources, { "": "operators/page.html", "page.css": "style.css" }[name] ?? name) });
    });
  }
  const page = await context.newPage();
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (line) => line.text().includes("Content Security Policy") && complaints.push(line.text()));
  await page.goto(base + path);
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
  await page.setViewportSize({ width: 1400, height: 1000 });
}

const running = (page) => page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: 30_000 });
const timeOf = async (page) => Number((await page.getByRole("status").textContent()).match(/Running, ([\d.]+) s/)?.[1]);

const starter = await person("/operate");
await starter.locator("option[value=handover]").waitFor({ state: "attached" });
await starter.locator("select[name=task]").selectOption("handover");
await starter.getByRole("button", { name: "Start" }).click();
const links = starter.getByRole("link", { name: /Drive robot/ });
await links.first().waitFor();
const [a, b] = await links.evaluateAll((found) => found.map((link) => link.getAttribute("href")));
await pictures(starter, "start");

const pageA = await person(a);
await pageA.getByRole("status").filter({ hasText: "Time stands still" }).waitFor();
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
await pageA.getByRole("status").filter({ hasText: "Time stands still" }).waitFor();
const stood = (await stateOf(a, "A")).time_s;
await pageA.waitForTimeout(1500);
assert.equal((await stateOf(a, "A")).time_s, stood);
pageB = await person(b);
await Promise.all([running(pageA), running(pageB)]);

// Real time, as nearly as this machine draws.
const [clock, simulated] = [performance.now(), await timeOf(pageA)];
await pageA.waitForTimeout(3000);
const rate = (await timeOf(pageA) - simulated) / ((performance.now() - clock) / 1000);
console.log(`the world runs at ${rate.toFixed(2)} of real time`);
assert.ok(rate <= 1.05 && rate > 0.1, `${rate}`);

// A forged link drives nothing.
const forged = await person(a.replace(/token=[^&]*/, "token=0123456789abcdef0123456789abcdef01234567"));
await forged.getByRole("heading", { name: "Nothing to drive" }).waitFor();
assert.equal(await forged.getByRole("status").count(), 0, "a forged link drives");

await browser.close();
await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" });
const recording = join(runs, episode, "episode.mcap");
console.log(execFileSync(program, ["replay", recording, "--verify"], { encoding: "utf8" }).trim());
assert.deepEqual(complaints, []);
console.log("as it should be");
process.exit(0);
