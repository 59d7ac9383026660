// `tandem collect --operators 2` in a headless Chromium: whoever runs it opens the page with all links, two people follow theirs, play
// two episodes, mark one bad, and run the command again; and pictures of all pages for somebody to look at.
//
//     cargo build --release
//     mkdir -p /tmp/operate && cd /tmp/operate && npm install playwright-core@1.65.1
//     node REPOSITORY/tests/peers/pages/collect.mjs REPOSITORY/target/release/tandem
//
// Takes a chromium from the path, or from CHROMIUM. Pictures are written to the working folder.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join } from "node:path";

const { chromium } = createRequire(join(process.cwd(), "x"))("playwright-core");
const [program] = process.argv.slice(2);
const WIDTHS = [400, 1400, 2500];
/** Of a window that nobody looks at: software draws it. */
const SIZE = { width: 800, height: 600 };
/** How long a page may take on a machine that has other things to do. */
const PATIENCE_MS = 120_000;
const out = join(mkdtempSync(join(tmpdir(), "collect-")), "people");
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-background-networking", "--disable-component-update", "--disable-background-timer-throttling", "--disable-backgrounding-occluded-windows", "--disable-renderer-backgrounding", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const complaints = [];

/** Runs the command; answers with its links, and with what tells that it has ended. */
async function collect(seeds) {
  const flags = ["collect", "--operators", "2", "--tasks", "handover", "--protocol", "benchmark", "--renderer", "cpu", "--seeds", seeds, "--out", out];
  const running = spawn(program, flags, { stdio: ["ignore", "pipe", "ignore"] });
  process.on("exit", () => running.kill());
  const ended = new Promise((done) => running.on("exit", done));
  const links = await new Promise((resolve) => {
    let said = "";
    running.stdout.on("data", (data) => {
      said += data;
      if (said.includes("watch at")) resolve([...said.matchAll(/^(?:robot \w|all links): (\S+)$/gm)].map(([, link]) => link));
    });
  });
  return { links, ended };
}

async function open(link) {
  const context = await browser.newContext({ viewport: SIZE });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  page.on("pageerror", (error) => complaints.push(error.message));
  page.on("console", (line) => line.text().includes("Content Security Policy") && complaints.push(line.text()));
  await page.goto(link);
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

/** Both begin, drive for a moment, finish, and mark the episode. */
async function play(people, marks, looked) {
  for (const page of people) await page.getByRole("button", { name: "Begin" }).click();
  for (const page of people) await page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: PATIENCE_MS });
  await people[0].waitForTimeout(1500);
  for (const page of people) await page.getByRole("button", { name: "Finish" }).click();
  for (const page of people) await page.getByRole("button", { name: "Good" }).waitFor({ timeout: PATIENCE_MS });
  if (looked) await pictures(people[0], "mark");
  for (const [index, page] of people.entries()) await page.getByRole("button", { name: marks[index] }).click();
}

const first = await collect("2000-2001");
const overview = await open(first.links[2]);
await overview.getByRole("link", { name: "Drive robot B" }).waitFor();
await overview.locator("summary").first().click();
await pictures(overview, "overview");
let people = await Promise.all(first.links.slice(0, 2).map(open));
await people[0].getByRole("button", { name: "Begin" }).waitFor();
assert.ok(!people[0].url().includes("token"), "the token is still in the address");
await pictures(people[0], "begin");
await play(people, ["Good", "Good"], true);
await play(people, ["Good", "Bad"], false);
await people[1].getByText("That was the last one").waitFor();
await first.ended;
assert.ok(existsSync(join(out, "episodes/handover-2000/good")));
assert.equal(readFileSync(join(`${out}-bad`, "handover-2001/bad"), "utf8"), "marked bad by B\n");

const second = await collect("2000-2001");
people = await Promise.all(second.links.slice(0, 2).map(open));
await people[0].getByRole("heading", { name: "Episode 2 of 2: handover, seed 2001" }).waitFor();
await play(people, ["Good", "Good"], false);
await second.ended;
assert.ok(existsSync(join(out, "episodes/handover-2001/good")));
await browser.close();
assert.deepEqual(complaints, []);
console.log("as it should be");
process.exit(0);
