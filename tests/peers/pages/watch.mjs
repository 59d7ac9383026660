// The pages at /watch in a headless Chromium: calls watched as they are made, the demo watched live to its end, a finished episode
// scrubbed, and pictures of all for somebody to look at.
//
//     cargo build --release
//     mkdir -p /tmp/watch && cd /tmp/watch && npm install playwright-core@1.65.1
//     node REPOSITORY/tests/peers/pages/watch.mjs REPOSITORY/target/release/tandem
//
// Takes a chromium from the path, or from CHROMIUM. Pictures are written to the working folder.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const { chromium } = createRequire(join(process.cwd(), "x"))("playwright-core");
const [program] = process.argv.slice(2);
/** For whoever changes the page: the files of this folder in place of those in the program. */
const sources = process.env.TANDEM_WEB;
const WIDTHS = [400, 1400, 2500];

const runs = mkdtempSync(join(tmpdir(), "watch-"));

/** Starts the program, which serves until this one ends, and returns the link that it prints. */
function start(...words) {
  const server = spawn(program, [...words, "--runs", runs], { stdio: ["ignore", "pipe", "ignore"] });
  process.on("exit", () => server.kill());
  return new Promise((resolve) => {
    let said = "";
    server.stdout.on("data", (data) => {
      said += data;
      const found = said.match(/watch at (\S+)\n/);
      if (found) resolve(found[1]);
    });
  });
}

const link = await start("serve", "--listen", "127.0.0.1:0");
const base = new URL(link).origin;

const call = async (path, body) => {
  const answer = await fetch(base + path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
  assert(answer.ok, `${path}: ${await answer.clone().text()}`);
  return answer.status === 204 ? null : answer.json();
};

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync"],
});

async function open(width, scheme, link) {
  const context = await browser.newContext({ viewport: { width, height: Math.round(Math.min(width * 1.6, 1400)) }, colorScheme: scheme });
  const page = await context.newPage();
  page.wrong = [];
  page.on("pageerror", (error) => page.wrong.push(error.message));
  page.on("console", (message) => message.type() === "error" && page.wrong.push(message.text()));
  page.on("request", (request) => request.url().startsWith(new URL(link).origin) || request.url().startsWith("blob:") || page.wrong.push(`asks ${request.url()}`));
  if (sources) {
    await page.route("**/watch/page.js", (route) => route.fulfill({ path: join(sources, "dist/page.js"), contentType: "text/javascript" }));
    await page.route("**/watch/page.css", (route) => route.fulfill({ path: join(sources, "style.css"), contentType: "text/css" }));
  }
  await page.goto(link);
  await page.waitForSelector("h2");
  return page;
}

const wide = await open(1400, "light", link);

// Who has not come by the link sees the door.
const stranger = await (await browser.newContext()).newPage();
await stranger.goto(`${base}/watch`);
assert.match(await stranger.textContent("body"), /open the link/);

// A live one.
const { episode_id: id } = await call("/v1/episodes", { task: "handover", seed: 2000, protocol: "benchmark" });
await wide.waitForSelector(".card .live");
await wide.screenshot({ path: "cards-running.png" });
await wide.click(".card");
await wide.waitForSelector(".view canvas");
await wide.check("#look");
const tool = (name, body) => call(`/v1/episodes/${id}/tools/${name}`, body);
const note = (text, more) => call(`/v1/episodes/${id}/notes`, { text, kind: "thought", model: "a-model", ...more });
await note("I look first: where is the bottle, and what do A and B see of it?", { tokens: { input: 5210, output: 84, cached: 4800 }, usd: 0.004, seconds: 2.5 });
await tool("observe", {});
await fetch(`${base}/v1/episodes/${id}/tools/move_wrists`, { method: "POST", headers: { "content-type": "application/json" }, body: '{"steps": "many"}' });
await note(`B reaches too far on purpose. ${"It is to be seen that this is told, however long it takes. ".repeat(12)}`, { robot: "B" });
for (let reach = 0; reach < 6; reach += 1) {
  await tool("move_wrists", { steps: 25, robots: [
    { robot: "A", right_position_m: [0.3, -0.15, 0.1 + 0.04 * reach], right_quaternion_wxyz: [1, 0, 0, 0] },
    { robot: "B", left_position_m: [0.9, 0.2, 0.2], left_quaternion_wxyz: [1, 0, 0, 0] }] });
  await new Promise((resolve) => { setTimeout(resolve, 300); });
}
await wide.waitForFunction(() => document.querySelectorAll(".story li").length === 10);
await wide.waitForSelector(".pictures img");
await wide.waitForFunction(() => /3\.0 s/.test(document.querySelector(".facts").textContent));
assert.doesNotMatch(await wide.locator("main").innerText(), /\b(null|undefined|NaN)\b/);
assert.equal(await wide.locator(".story .seen img").count(), 2, "the pictures that the policy was shown");
for (const width of WIDTHS) {
  for (const scheme of ["light", "dark"]) {
    await wide.setViewportSize({ width, height: Math.round(Math.min(width * 1.6, 1400)) });
    await wide.emulateMedia({ colorScheme: scheme });
    await wide.waitForTimeout(1200);
    await wide.screenshot({ path: `live-${width}-${scheme}.png`, fullPage: width === 400 });
    const beyond = await wide.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert(beyond <= 0, `${beyond} pixels beyond a width of ${width}`);
  }
}
await wide.setViewportSize({ width: 1400, height: 1000 });
await wide.selectOption(".tools select", "A");
await wide.waitForTimeout(500);
assert((await wide.locator(".view").screenshot({ path: "live-as-A.png" })).length > 30_000, "robot A sees something");
const rate = await wide.evaluate(() => new Promise((resolve) => {
  const began = performance.now();
  let frames = 0;
  const count = () => (++frames, performance.now() - began < 2000 ? requestAnimationFrame(count) : resolve(frames / 2));
  requestAnimationFrame(count);
}));
console.log(`${rate} frames a second at rest, in software`);
await fetch(`${base}/v1/episodes/${id}`, { method: "DELETE" });
await wide.waitForSelector("text=Look at it again");
assert.deepEqual(wide.wrong, []);

// The same, finished.
await wide.click("text=Look at it again");
await wide.waitForSelector(".scrubber");
await wide.locator(".track input").fill("1.4");
await wide.waitForFunction(() => /1\.40 of/.test(document.querySelector(".scrubber output").textContent));
await wide.check("#look");
await wide.waitForSelector(".pictures img");
// What happened is told in its order, with what was said, refused and shown, and goes along with the moment.
const told = await wide.locator(".story li").allInnerTexts();
assert.equal(told.length, 10);
assert(/thought, a-model/.test(told[0]) && /5210 tokens read \(4800 from a cache\), 84 written; \$0\.0040; 2\.5 s/.test(told[0]), told[0]);
assert(/–\s+move_wrists\s+refused: move_wrists: steps/.test(told[2]), told[2]);
assert(/^B, thought/.test(told[3]), told[3]);
await wide.click("text=All of it");
assert.equal(await wide.locator(".story .seen img").count(), 2);
await wide.waitForFunction(() => [...document.querySelectorAll(".story .seen img")].every((image) => image.naturalWidth === 320));
assert.match(await wide.locator(".bands").innerText(), /p1 grasp and lift/);
assert.match(await wide.locator(".track canvas").getAttribute("aria-label"), /6 commands, 1 looks and questions, 1 refused, 2 notes/);
assert.doesNotMatch(await wide.locator("main").innerText(), /\b(null|undefined|NaN)\b/);
const current = () => wide.locator('.story [aria-current="step"] code').innerText();
assert.equal(await current(), "move_wrists");
const moment = () => wide.locator(".scrubber output").innerText();
await wide.click('[aria-label="The next call"]');
await wide.waitForFunction(() => /^1\.50 of/.test(document.querySelector(".scrubber output").textContent));
await wide.click('[aria-label="The call before"]');
await wide.waitForFunction(() => /^1\.00 of/.test(document.querySelector(".scrubber output").textContent));
await wide.locator(".track canvas").click({ position: { x: 1, y: 5 } });
await wide.waitForFunction(() => !/^1\.00 of/.test(document.querySelector(".scrubber output").textContent));
await wide.uncheck("#look");
await wide.waitForFunction(() => /call 1 at 0\.0 s/.test(document.querySelector(".pictures").textContent));
assert.match(await wide.locator(".plots").first().innerText(), /Tokens \[thousands so far\] 5\.3/);
await wide.locator(".story details").first().click();
await wide.locator(".track input").fill("1.4");
for (const width of WIDTHS) {
  for (const scheme of ["light", "dark"]) {
    await wide.setViewportSize({ width, height: Math.round(Math.min(width * 1.6, 1400)) });
    await wide.emulateMedia({ colorScheme: scheme });
    await wide.waitForTimeout(1200);
    await wide.screenshot({ path: `finished-${width}-${scheme}.png`, fullPage: true });
    const beyond = await wide.evaluate(() => document.documentElement.scrollWidth - innerWidth);
    assert(beyond <= 0, `${beyond} pixels beyond a width of ${width}`);
  }
}
await wide.setViewportSize({ width: 1400, height: 1000 });
await wide.emulateMedia({ colorScheme: "light" });
console.log(`shown: ${await moment()}`);
await wide.click(".scrubber .play");
await wide.waitForFunction(() => document.querySelector(".scrubber .play").textContent === "Pause");
await wide.waitForFunction(() => !/1\.40 of/.test(document.querySelector(".scrubber output").textContent));
await wide.click("text=Show its film");
await wide.waitForFunction(() => [...document.images].some((image) => image.src.includes("/film") && image.naturalWidth > 0), null, { timeout: 60000 });
await wide.click("text=All episodes");
await wide.waitForSelector(".card img");
for (const width of WIDTHS) {
  await wide.setViewportSize({ width, height: 1000 });
  await wide.waitForTimeout(300);
  await wide.screenshot({ path: `cards-${width}.png` });
}
assert.deepEqual(wide.wrong, []);

// The demo's calls once more, over HTTP and slowly enough to be watched, to the last phase.
await new Promise((resolve) => { spawn(program, ["demo", "--seeds", "2001", "--runs", runs]).on("exit", resolve); });
const key = { authorization: `Bearer ${new URL(link).hash.slice(1)}` };
const recorded = await (await fetch(`${base}/watch/run?run=handover-seed2001`, { headers: key })).arrayBuffer();
const { story, result } = JSON.parse(new TextDecoder().decode(recorded.slice(4, 4 + new DataView(recorded).getUint32(0, true))));
const { episode_id: again } = await call("/v1/episodes", { task: "handover", seed: 2001, protocol: "agentic" });
await wide.goto(`${base}/watch?episode=${again}`);
await wide.waitForSelector(".view canvas");
let frames = 0;
for (const made of story.filter(({ kind, number }) => kind === "call" && number !== null)) {
  await call(`/v1/episodes/${again}/tools/${made.tool}`, JSON.parse(made.arguments));
  await wide.waitForTimeout(150);
  if (++frames === 30) await wide.screenshot({ path: "demo-half.png" });
}
await wide.waitForFunction(() => document.querySelectorAll(".phases .done").length === 3);
await wide.waitForSelector(".top .good");
await wide.waitForTimeout(1500);
await wide.screenshot({ path: "demo-end.png" });
const ended = await (await fetch(`${base}/v1/episodes/${again}`, { method: "DELETE" })).json();
assert.equal(ended.state_hash, result.state_hash, "watched or not, the same calls lead to the same state");
assert.deepEqual(wide.wrong, []);
await browser.close();
console.log("watched, scrubbed, and nothing went wrong; look at the pictures");
process.exit(0);
