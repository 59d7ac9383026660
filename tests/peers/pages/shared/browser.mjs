// Shared parts of the scripts in the parent folder: a headless Chromium whose page errors are collected, pictures of pages for
// inspection, and the problems that axe finds.
//
//     cargo build --release
//     (cd tests/peers/pages && npm ci --ignore-scripts)
//     mkdir -p /tmp/pages && cd /tmp/pages
//     node REPOSITORY/tests/peers/pages/operate.mjs REPOSITORY/target/release/tandem
//
// Takes a chromium from the path, or from CHROMIUM. Pictures are written to the working folder. During work on the pages, the files
// of the folder TANDEM_WEB replace those in the program.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { deadline } from "./server.mjs";

export * from "./server.mjs";

export const WIDTHS = [400, 1400, 2500];
/** Flags for a window without a display, drawn in software. */
export const SIZE = { width: 800, height: 600 };
/** Maximum time of a page on a busy machine. */
export const PATIENCE_MS = 120_000;
/** Maximum time of a whole script there, in minutes. */
const PATIENCE_MIN = 30;
/** Errors and warnings that pages have logged. */
export const complaints = [];

const sources = process.env.TANDEM_WEB;
const axe = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

deadline(PATIENCE_MIN);

export const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding"],
});

/**
 * Opens the page of a person in a separate context. `before` runs in the page before its own scripts.
 * @param {string} link
 * @param {import("playwright-core").BrowserContextOptions & { before?: any }} [options]
 */
export async function open(link, { before, ...options } = {}) {
  const context = await browser.newContext({ viewport: SIZE, ignoreHTTPSErrors: true, ...options });
  context.setDefaultTimeout(PATIENCE_MS);
  for (const script of [before ?? []].flat()) await context.addInitScript(script);
  const page = await context.newPage();
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (line) => line.text().includes("Content Security Policy") && complaints.push(line.text()));
  page.on("request", (request) => {
    const { origin, protocol } = new URL(request.url());
    if (origin !== new URL(link).origin && protocol !== "blob:") complaints.push(`asks ${request.url()}`);
  });
  if (sources) {
    // The page itself still comes from the server, because a page from another origin may not open a socket to this machine.
    await context.route(/\/(home|watch|operate)\/page\./, (route) => {
      const name = new URL(route.request().url()).pathname.endsWith("css") ? "style.css" : "dist/page.js";
      return route.fulfill({ path: join(sources, name) });
    });
  }
  await page.goto(link);
  return page;
}

/** Takes pictures of a page, narrow and wide, light and dark. Checks that it is never wider than its window, and runs axe. */
export async function pictures(page, name, { heights = {}, settleMs = 0 } = {}) {
  const before = page.viewportSize();
  for (const colorScheme of ["light", "dark"]) {
    await page.emulateMedia({ colorScheme });
    for (const width of WIDTHS) {
      await page.setViewportSize({ width, height: heights[width] ?? 1000 });
      if (settleMs) await page.waitForTimeout(settleMs);
      await page.evaluate(paintAll);
      await page.screenshot({ path: `${name}-${width}-${colorScheme}.png`, fullPage: true });
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${name} is ${wide} pixels wide in a window of ${width}`);
      await accessible(page, `${name}, ${width} pixels, ${colorScheme}`);
    }
  }
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize(before);
}

/** Scrolls through a page and back, because a browser paints scrollable parts, such as lists, only once they have been visible. */
async function paintAll() {
  for (let top = 0; top < document.documentElement.scrollHeight; top += innerHeight / 2) {
    scrollTo(0, top);
    for (let frame = 0; frame < 3; frame += 1) await new Promise((drawn) => { requestAnimationFrame(drawn); });
  }
  scrollTo(0, 0);
  await new Promise((drawn) => { requestAnimationFrame(drawn); });
}

/** Runs axe on a page, which must find no serious problem. */
export async function accessible(page, name) {
  if (!await page.evaluate(() => Boolean(window.axe))) await page.evaluate(axe);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const told = violations.map(({ impact, id, nodes }) => `${impact}: ${id}: ${nodes.map(({ html, failureSummary }) => `${html} ${failureSummary}`).slice(0, 3).join(" | ")}`);
  for (const line of told) console.log(`axe, ${name}: ${line}`);
  const serious = violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
  assert.deepEqual(serious.map(({ id }) => id), [], `axe finds something serious on ${name}`);
}

/** Runs in a page before its scripts, and counts the frames in which the page has drawn. */
export function countDrawn() {
  window.drawn = 0;
  let drawing = false;
  const draw = WebGL2RenderingContext.prototype.drawElements;
  WebGL2RenderingContext.prototype.drawElements = function (...given) {
    drawing = true;
    draw.apply(this, given);
  };
  const count = () => {
    window.drawn += Number(drawing);
    drawing = false;
    requestAnimationFrame(count);
  };
  requestAnimationFrame(count);
}

/** Returns the number of frames of the scene that such a page draws in a second. */
export async function drawnRate(page, seconds = 3) {
  const [began, before] = [performance.now(), await page.evaluate(() => window.drawn)];
  await page.waitForTimeout(1000 * seconds);
  return (await page.evaluate(() => window.drawn) - before) / ((performance.now() - began) / 1000);
}

export const median = (values) => values.toSorted((one, other) => one - other)[Math.floor(values.length / 2)];

/** Waits until something is as it should be, and says what it came to. */
export async function until(what, measure, least) {
  const deadline = performance.now() + PATIENCE_MS;
  for (;;) {
    const value = await measure();
    if (value >= least || performance.now() > deadline) {
      console.log(`${what}: ${value.toFixed(3)}`);
      assert.ok(value >= least, what);
      return;
    }
    await new Promise((passed) => { setTimeout(passed, 250); });
  }
}

/** Ends the script: no page may have complained. */
export async function done() {
  await browser.close();
  assert.deepEqual(complaints, []);
  console.log("as it should be");
  process.exit(0);
}
