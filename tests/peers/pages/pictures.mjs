// Pictures of every page, at 400, 1400 and 2500 pixels, light and dark, for inspection: the start page, an episode that is
// played, driven and finished, an evaluation and its report. No page may be wider than its window, and axe may find no serious problem.
// shared/browser.mjs describes how to run it. The other scripts test the functions of the pages.
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { PATIENCE_MS, browser, done, open, pictures, post, run, serve } from "./shared/browser.mjs";

/** Settings for pages with a scene drawn in software: a minimal size, and the time that it takes. */
const SCENE = { heights: { 400: 700, 1400: 1000, 2500: 1400 }, settleMs: 1500 };

const { link, base, runs } = await serve();
const played = async (...words) => { await (await run(words, /./)).ended; };

// The server has no episodes yet.
const page = await open(base);
await pictures(page, "home-empty");
const stranger = await (await browser.newContext()).newPage();
await stranger.goto(`${base}/watch`);
await pictures(stranger, "door");
await stranger.context().close();
await page.goto(link);
await page.getByText("None runs.").waitFor();
await pictures(page, "cards-empty");

// In this evaluation robots replay the demonstration of another seed three times.
const plan = (seeds) => ["--tasks", "handover", "--protocol", "benchmark", "--seeds", seeds];
await played("collect", ...plan("2000"), "--out", join(runs, "demonstration"));
await played("evaluate", "--policy", `open-loop:${join(runs, "demonstration")}`, ...plan("2001-2003"), "--jobs", "1", "--record", "--out", join(runs, "replayed"));
await played("report", join(runs, "replayed"));
await pictures(await (async () => {
  const reader = await (await browser.newContext()).newPage();
  await reader.goto(pathToFileURL(join(runs, "replayed", "report.html")).href);
  await reader.evaluate(() => Promise.all([...document.images].map((image) => Object.assign(image, { loading: "eager" }).decode())));
  return reader;
})(), "report");

// People start an episode.
await page.goto(`${base}/operate`);
await page.locator("option[value=handover]").waitFor({ state: "attached" });
await page.locator("select[name=task]").selectOption("handover");
await page.locator("input[name=seed]").fill("2000");
await pictures(page, "operate-start");
await page.locator("select[name=B]").selectOption("program");
await page.getByRole("button", { name: "Start" }).click();
const seat = await page.getByRole("link", { name: "Drive robot A" }).getAttribute("href");
await page.locator("summary").first().click();
await pictures(page, "operate-links");
const program = Object.fromEntries((await page.locator("pre").innerText()).split("\n").map((line) => line.split("=")));
const episode = program.TANDEM_EPISODE;

// One person drives together with a program.
const driver = await open(seat);
await driver.getByText("Time stands still").waitFor({ timeout: PATIENCE_MS });
await pictures(driver, "drive-waits", SCENE);
await driver.keyboard.press("2");
await driver.keyboard.down("PageUp");
for (let reach = 0; reach < 4; reach += 1) {
  await post(base, `/v1/episodes/${episode}/tools/move_wrists`, { steps: 20, robots: [{ robot: "B", right_position_m: [0.35, -0.2, 0.05 + 0.05 * reach] }] }, program.TANDEM_TOKEN);
}
await driver.keyboard.up("PageUp");
await post(base, `/v1/episodes/${episode}/tools/say`, { text: "I wait for it at the middle of the table." }, program.TANDEM_TOKEN);
await post(base, `/v1/episodes/${episode}/tools/wait`, { steps: 10 }, program.TANDEM_TOKEN);
await pictures(driver, "drive", SCENE);

// Other people watch.
await page.goto(base);
await pictures(page, "home");
await page.goto(`${base}/watch?episode=${episode}`);
await page.waitForSelector(".view canvas");
await page.check("#look");
await page.waitForSelector(".pictures img");
await pictures(page, "live", SCENE);
await page.goto(`${base}/watch`);
await page.locator("progress").first().waitFor();
await pictures(page, "cards", { settleMs: 500 });

// The episode ends, is opened again, and a person continues it.
await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" });
await driver.getByText("The episode has ended").waitFor({ timeout: PATIENCE_MS });
await pictures(driver, "drive-over", SCENE);
await driver.context().close();
await page.goto(`${base}/watch?run=${episode}`);
await page.waitForSelector(".scrubber");
await page.locator(".track input").fill("1");
await page.locator(".story details").first().click();
await pictures(page, "finished", SCENE);
await page.click("text=Take over here");
await page.getByText(/stood at 1\.0 s/).waitFor();
await pictures(page, "take-over");

// A failed episode follows.
await page.goto(`${base}/watch`);
await page.locator(".card", { has: page.locator(".badge.bad"), hasText: "replayed" }).first().click();
await page.waitForSelector(".scrubber");
await pictures(page, "failed", SCENE);
await page.goto(`${base}/watch?run=nothing`);
await page.getByRole("heading", { name: "Nothing to show" }).waitFor();
await pictures(page, "nothing");
await done();
