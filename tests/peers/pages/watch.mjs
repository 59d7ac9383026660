// The pages at /watch in a headless Chromium: calls watched as they are made, the demo watched live to its end, a finished episode
// scrubbed and taken over, and an evaluation's card that fills. How it is run is said in shared/browser.mjs.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { accessible, browser, done, folder, open, post, program, serve, until } from "./shared/browser.mjs";

/** Two pixels whose values differ by no more are alike; so many are, and so large a share of the view has each of the file's colours. */
const [MOST_LEVELS_APART, LEAST_ALIKE, LEAST_SHARE] = [6, 0.8, 0.02];

const { link, base, runs } = await serve();
const call = (path, body) => post(base, path, body);

const page = await open(link);
await page.getByRole("heading", { name: "Finished" }).waitFor();

// Who has not come by the link sees the door.
const stranger = await (await browser.newContext()).newPage();
await stranger.goto(`${base}/watch`);
assert.match(await stranger.textContent("body"), /open the link/);
await accessible(stranger, "the door");

// A live one.
const { episode_id: id } = await call("/v1/episodes", { task: "handover", seed: 2000, protocol: "benchmark" });
await page.waitForSelector(".card .live");
await page.click(".card h3 a");
await page.waitForSelector(".view canvas");
await page.check("#look");
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
await page.waitForFunction(() => document.querySelectorAll(".story li").length === 10);
await page.waitForSelector(".pictures img");
await page.waitForFunction(() => /3\.0 s/.test(document.querySelector(".facts").textContent));
assert.doesNotMatch(await page.locator("main").innerText(), /\b(null|undefined|NaN)\b/);
assert.equal(await page.locator(".story .seen img").count(), 2, "the pictures that the policy was shown");
assert.match(await page.locator(".phases .lacks").innerText(), /does not hold bottle/, "what the next phase lacks");
await accessible(page, "a live episode");
await page.selectOption(".tools select", "A");
await page.waitForTimeout(500);
assert((await page.locator(".view").screenshot()).length > 20_000, "robot A sees something");
await fetch(`${base}/v1/episodes/${id}`, { method: "DELETE" });
await page.waitForSelector("text=Look at it again");

// The same, finished.
await page.click("text=Look at it again");
await page.waitForSelector(".scrubber");
await page.locator(".track input").fill("1.4");
await page.waitForFunction(() => /1\.40 of/.test(document.querySelector(".scrubber output").textContent));
await page.check("#look");
await page.waitForSelector(".pictures img");
// What happened is told in its order, with what was said, refused and shown, and goes along with the moment.
const told = await page.locator(".story li").allInnerTexts();
assert.equal(told.length, 10);
assert(/thought, a-model/.test(told[0]) && /5210 tokens read \(4800 from a cache\), 84 written; \$0\.0040; 2\.5 s/.test(told[0]), told[0]);
assert(/–\s+move_wrists\s+refused: move_wrists: steps/.test(told[2]), told[2]);
assert(/^B, thought/.test(told[3]), told[3]);
await page.click("text=All of it");
assert.equal(await page.locator(".story .seen img").count(), 2);
await page.waitForFunction(() => [...document.querySelectorAll(/** @type {"img"} */ (".story .seen img"))].every((image) => image.naturalWidth === 320));
assert.match(await page.locator(".bands").innerText(), /p1 grasp and lift/);
assert.match(await page.locator(".track canvas").getAttribute("aria-label"), /6 commands, 1 looks and questions, 1 refused, 2 notes/);
assert.doesNotMatch(await page.locator("main").innerText(), /\b(null|undefined|NaN)\b/);
const current = () => page.locator('.story [aria-current="step"] code').innerText();
assert.equal(await current(), "move_wrists");
const moment = () => page.locator(".scrubber output").innerText();
await page.click('[aria-label="The next call"]');
await page.waitForFunction(() => /^1\.50 of/.test(document.querySelector(".scrubber output").textContent));
await page.click('[aria-label="The call before"]');
await page.waitForFunction(() => /^1\.00 of/.test(document.querySelector(".scrubber output").textContent));
await page.locator(".track canvas").click({ position: { x: 1, y: 5 } });
await page.waitForFunction(() => !/^1\.00 of/.test(document.querySelector(".scrubber output").textContent));
await page.uncheck("#look");
await page.waitForFunction(() => /call 1 at 0\.0 s/.test(document.querySelector(".pictures").textContent));
assert.match(await page.locator(".plots").first().innerText(), /Tokens \[thousands so far\] 5\.3/);
await page.locator(".story details").first().click();
await page.locator(".track input").fill("1.4");
await accessible(page, "a finished episode");
console.log(`shown: ${await moment()}`);
await page.click(".scrubber .play");
await page.waitForFunction(() => document.querySelector(".scrubber .play").textContent === "Pause");
await page.waitForFunction(() => !/1\.40 of/.test(document.querySelector(".scrubber output").textContent));
// People take over from there.
await page.click(".scrubber .play");
await page.locator(".track input").fill("1.4");
await page.click("text=Take over here");
await page.getByText(/stood at 1\.4 s: handover, seed 2000/).waitFor();
await page.locator("select[name=B]").selectOption("still");
await accessible(page, "taking over");
await page.getByRole("button", { name: "Start" }).click();
const over = await page.getByRole("link", { name: "Drive robot A" }).getAttribute("href");
const taker = await open(over);
await taker.getByRole("status").filter({ hasText: "Running" }).waitFor();
// Nobody else would finish for the robot that stands still.
await taker.getByRole("button", { name: "Finish" }).click();
await taker.getByText("The episode has ended: finished.").waitFor();
await taker.context().close();
await page.goBack();
await page.waitForSelector(".scrubber");
await page.click("text=Show its film");
await page.waitForFunction(() => [...document.images].some((image) => image.src.includes("/film") && image.naturalWidth > 0));
await page.click("text=All episodes");
await page.waitForSelector(".card img");
await accessible(page, "cards");

// An evaluation that another process plays fills its card. It has more episodes than anybody waits for.
const evaluation = spawn(program, ["evaluate", "--policy", "idle", "--tasks", "handover", "--seeds", "2000-2999", "--jobs", "1", "--out", join(runs, "evaluation")]);
process.on("exit", () => evaluation.kill());
const card = page.locator(".card", { has: page.locator("progress") });
await card.getByText("runs").waitFor();
const [first, planned] = await card.locator("progress").evaluate((/** @type {HTMLProgressElement} */ { value, max }) => [value, max]);
assert.ok(planned === 1000 && first < planned, `${first} of ${planned}`);
await page.waitForFunction((before) => document.querySelector("progress").value > before, first);
evaluation.kill();

// The demo's calls once more, over HTTP and slowly enough to be watched, to the last phase.
await new Promise((resolve) => { spawn(program, ["demo", "--seeds", "2001", "--runs", runs]).on("exit", resolve); });
const key = { authorization: `Bearer ${new URL(link).hash.slice(1)}` };
const recorded = await (await fetch(`${base}/watch/run?run=handover-seed2001`, { headers: key })).arrayBuffer();
const { story, result } = JSON.parse(new TextDecoder().decode(recorded.slice(4, 4 + new DataView(recorded).getUint32(0, true))));
const { episode_id: again } = await call("/v1/episodes", { task: "handover", seed: 2001, protocol: "agentic" });
await page.goto(`${base}/watch?episode=${again}`);
await page.waitForSelector(".view canvas");
for (const made of story.filter(({ kind, number }) => kind === "call" && number !== null)) {
  await call(`/v1/episodes/${again}/tools/${made.tool}`, JSON.parse(made.arguments));
  await page.waitForTimeout(50);
}
await page.waitForFunction(() => document.querySelectorAll(".phases .done").length === 3);
await page.waitForSelector(".top .good");
await page.screenshot({ path: "demo-end.png" });
const ended = await (await fetch(`${base}/v1/episodes/${again}`, { method: "DELETE" })).json();
assert.equal(ended.state_hash, result.state_hash, "watched or not, the same calls lead to the same state");
await looks();
await done();

/**
 * A scene with images on its surfaces, in light that adds nothing to their colours: robot A's view is drawn in the page as it is by the
 * server, in the colours of the file, and images come once for all episodes.
 */
async function looks() {
  const scene = join(folder("scene"), "scene.xml");
  const colours = { first: [204, 77, 26], second: [26, 128, 179], wall: [128, 204, 51] };
  const rgb = (values) => values.map((value) => value / 255).join(" ");
  writeFileSync(scene, `<mujoco>
    <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
    <asset>
      <texture name="squares" type="2d" builtin="checker" rgb1="${rgb(colours.first)}" rgb2="${rgb(colours.second)}" width="64" height="64"/>
      <texture name="faces" type="cube" builtin="gradient" rgb1="${rgb(colours.wall)}" rgb2="${rgb(colours.wall)}" width="64" height="64"
        mark="edge" markrgb="0 0 0"/>
      <material name="squares" texture="squares" texuniform="true" texrepeat="1 1"/>
      <material name="faces" texture="faces"/>
    </asset>
    <worldbody>
      <geom type="plane" size="4 4 0.1" material="squares"/>
      <geom type="box" size="0.1 2.5 1" pos="2 0 1" material="faces"/>
      <site name="task" pos="0 0 0"/>
    </worldbody>
  </mujoco>`);
  const other = await serve("--scene", scene);
  const begun = await Promise.all([2000, 2001].map((seed) => post(other.base, "/v1/episodes", { task: "table_align", seed, protocol: "benchmark" })));
  const viewer = await open(other.link);
  const received = [];
  for (const { episode_id: episode } of begun) {
    await viewer.goto(`${other.base}/watch?episode=${episode}`);
    await viewer.waitForSelector(".view canvas");
    for (const extra of await viewer.locator(".tools input").all()) await extra.uncheck();
    await viewer.selectOption(".tools select", "A");
    await viewer.waitForFunction(() => performance.getEntriesByType("resource").filter(({ name }) => name.includes("/texture?")).length === 3);
    received.push(await viewer.evaluate(() => performance.getEntriesByType("resource")
      .filter(({ name }) => name.includes("/texture?")).map((entry) => [entry.name, /** @type {PerformanceResourceTiming} */ (entry).transferSize])));
  }
  const [[...first], [...second]] = received.map((entries) => entries.toSorted());
  assert.deepEqual(first.map(([name]) => name), second.map(([name]) => name), "the same images");
  assert.ok(first.every(([, bytes]) => bytes > 0) && second.every(([, bytes]) => bytes === 0), `images come once: ${received}`);
  const compare = () => compared(viewer, `/watch/camera?episode=${begun[1].episode_id}&robot=A`, colours);
  await until("robot A's view as the server draws it", async () => (await compare()).alike, LEAST_ALIKE);
  const drawn = await compare();
  console.log(`looks: ${JSON.stringify(drawn)}`);
  for (const [name, [page, server]] of Object.entries(drawn.colours)) {
    assert.ok(server > LEAST_SHARE && Math.abs(page / server - 1) < 0.1, `${name} is ${page} of the page and ${server} of the server's image`);
  }
  await viewer.context().close();
}

/**
 * Compares what a page draws of a robot's view with the server's image. Returns the share of pixels that are alike, and for each colour its
 * shares of both.
 */
async function compared(page, path, colours) {
  const shown = (await page.locator(".view").screenshot()).toString("base64");
  return page.evaluate(async ({ shown, path, colours, most }) => {
    const pixels = async (file) => {
      const image = await createImageBitmap(file);
      const paper = new OffscreenCanvas(320, 240).getContext("2d");
      const scale = Math.min(image.width / 320, image.height / 240);
      const [width, height] = [320 * scale, 240 * scale];
      paper.drawImage(image, (image.width - width) / 2, (image.height - height) / 2, width, height, 0, 0, 320, 240);
      const { data } = paper.getImageData(0, 0, 320, 240);
      return Array.from({ length: 320 * 240 }, (_, at) => [...data.subarray(4 * at, 4 * at + 3)]);
    };
    const own = await pixels(new Blob([Uint8Array.from(atob(shown), (letter) => letter.charCodeAt(0))]));
    const server = await pixels(await (await fetch(path)).blob());
    const near = (one, other) => one.every((value, axis) => Math.abs(value - other[axis]) <= most);
    const share = (all, of) => all.filter(of).length / all.length;
    return {
      alike: own.filter((pixel, at) => near(pixel, server[at])).length / own.length,
      colours: Object.fromEntries(Object.entries(colours).map(([name, rgb]) => [name, [own, server].map((all) => share(all, (pixel) => near(pixel, rgb)))])),
    };
  }, { shown, path, colours, most: MOST_LEVELS_APART });
}
