// Links from reports to the pages. An evaluation whose robots replay the demonstration of another seed fails. Its report is opened as a
// file, and each of its links on the named server. The page opens a second before the failure. The cards of the same episodes are also
// tested. shared/browser.mjs describes how to run it.
import assert from "node:assert/strict";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { PATIENCE_MS, browser, done, open, pictures, run, serve } from "./shared/browser.mjs";

const { link, base, runs } = await serve();
const played = async (...words) => { await (await run(words, /./)).ended; };
const plan = (seeds) => ["--tasks", "handover", "--protocol", "benchmark", "--seeds", seeds];
await played("collect", ...plan("2000"), "--out", join(runs, "demonstration"));
await played("evaluate", "--policy", `open-loop:${join(runs, "demonstration")}`, ...plan("2001-2006"), "--jobs", "1", "--record", "--out", join(runs, "replayed"));
await played("report", join(runs, "replayed"));

const reader = await (await browser.newContext({ viewport: { width: 1400, height: 1000 } })).newPage();
await reader.goto(pathToFileURL(join(runs, "replayed", "report.html")).href);
const hrefs = await reader.locator('a[href*="/watch?run="]').evaluateAll((links) => [...new Set(links.map((/** @type {HTMLAnchorElement} */ { href }) => href))]);
assert.ok(hrefs.length > 0, "no episode of the report has gone wrong, or none is linked");
await reader.screenshot({ path: "report.png", fullPage: true });

const page = await open(link, { viewport: { width: 1400, height: 1000 } });
await page.waitForSelector(".card");
for (const href of hrefs) {
  const { pathname, search, searchParams } = new URL(href);
  await page.goto(base + pathname + search);
  await page.locator(".scrubber output").filter({ hasText: `${Number(searchParams.get("at")).toFixed(2)} of` }).waitFor({ timeout: PATIENCE_MS });
  console.log(`${search}: ${await page.locator(".scrubber output").innerText()}, ${await page.locator(".bands").innerText()}`);
}
await pictures(page, "from-report", { heights: { 400: 640, 1400: 1400, 2500: 1400 }, settleMs: 1500 });

// A card of a failed episode opens at its end, where it failed.
await page.goto(`${base}/watch`);
await page.locator(".card", { has: page.locator(".badge.bad") }).first().click();
const moment = page.locator(".scrubber output");
await moment.waitFor({ timeout: PATIENCE_MS });
const [at, end] = (await moment.innerText()).match(/[\d.]+/g).map(Number);
assert.ok(end - at < 0.06, `it opens at ${at} of ${end} s`);
await done();
