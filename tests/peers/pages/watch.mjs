// The pages at /watch in a headless Chromium: calls watched as they are made, the demo watched live to its end, a finished episode
// scrubbed and taken over, an evaluation's card that fills, and pictures of all for somebody to look at. How it is run is said in
// shared/browser.mjs.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { join } from "node:path";
import { accessible, browser, done, open, pictures, post, program, serve } from "./shared/browser.mjs";

const { link, base, runs } = await serve();
const call = (path, body) => post(base, path, body);

const wide = await open(link, { viewport: { width: 1400, height: 1000 } });
await wide.waitForSelector("h2");

// Who has not come by the link sees the door.
const stranger = await (await browser.newContext()).newPage();
await stranger.goto(`${base}/watch`);
assert.match(await stranger.textContent("body"), /open the link/);
await accessible(stranger, "the door");

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
await pictures(wide, "live", { heights: { 400: 640, 1400: 1400, 2500: 1400 }, settleMs: 1200 });
await wide.selectOption(".tools select", "A");
await wide.waitForTimeout(500);
assert((await wide.locator(".view").screenshot({ path: "live-as-A.png" })).length > 30_000, "robot A sees something");
await fetch(`${base}/v1/episodes/${id}`, { method: "DELETE" });
await wide.waitForSelector("text=Look at it again");

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
await pictures(wide, "finished", { heights: { 400: 640, 1400: 1400, 2500: 1400 }, settleMs: 1200 });
console.log(`shown: ${await moment()}`);
await wide.click(".scrubber .play");
await wide.waitForFunction(() => document.querySelector(".scrubber .play").textContent === "Pause");
await wide.waitForFunction(() => !/1\.40 of/.test(document.querySelector(".scrubber output").textContent));
// People take over from there.
await wide.click(".scrubber .play");
await wide.locator(".track input").fill("1.4");
await wide.click("text=Take over here");
await wide.getByText(/stood at 1\.4 s: handover, seed 2000/).waitFor();
await wide.locator("select[name=B]").selectOption("still");
await pictures(wide, "take-over");
await wide.getByRole("button", { name: "Start" }).click();
const over = await wide.getByRole("link", { name: "Drive robot A" }).getAttribute("href");
const taker = await open(over);
await taker.getByRole("status").filter({ hasText: "Running" }).waitFor();
await taker.context().close();
await wide.goBack();
await wide.waitForSelector(".scrubber");
await wide.click("text=Show its film");
await wide.waitForFunction(() => [...document.images].some((image) => image.src.includes("/film") && image.naturalWidth > 0), null, { timeout: 60000 });
await wide.click("text=All episodes");
await wide.waitForSelector(".card img");
await pictures(wide, "cards", { settleMs: 300 });

// An evaluation that another process plays fills its card.
const evaluation = spawn(program, ["evaluate", "--policy", "expert", "--tasks", "handover", "--seeds", "2000-2003", "--jobs", "1", "--out", join(runs, "evaluation")]);
const card = wide.locator(".card", { has: wide.locator("progress") });
const filled = () => card.locator("progress").evaluate(({ value, max }) => [value, max]);
await card.waitFor();
const [first, planned] = await filled();
assert.ok(planned === 4 && first < 4, `${first} of ${planned}`);
await card.getByText("runs").waitFor();
await new Promise((resolve) => { evaluation.on("exit", resolve); });
await card.getByText("4 of 4 episodes").waitFor();
await card.getByText("complete").waitFor();
await wide.screenshot({ path: "cards-evaluation.png" });

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
await done();
