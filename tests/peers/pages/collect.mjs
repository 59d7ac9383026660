// `tandem collect --operators 2` in a headless Chromium. The host opens the page with all links. Two people open their links, play
// two episodes and mark one bad, and the command runs again. The script also takes pictures of all pages for inspection.
// shared/browser.mjs describes how to run it.
import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { PATIENCE_MS, done, folder, open, pictures, run } from "./shared/browser.mjs";

const out = join(folder("collect"), "people");

/** Runs the command. Returns its links, and a promise of its end. */
async function collect(seeds) {
  const flags = ["--operators", "2", "--tasks", "handover", "--protocol", "benchmark", "--renderer", "cpu", "--seeds", seeds, "--out", out];
  const { said, ended } = await run(["collect", ...flags], /watch at/);
  return { links: [...said.matchAll(/^(?:robot \w|all links): (\S+)$/gm)].map(([, link]) => link), ended };
}

/** Lets both begin, drive for a moment, finish, and mark the episode. */
async function play(people, marks, looked) {
  for (const page of people) await page.getByRole("button", { name: "Begin" }).click();
  for (const page of people) await page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: PATIENCE_MS });
  await people[0].waitForTimeout(1500);
  for (const page of people) await page.getByRole("button", { name: "Finish" }).click();
  for (const page of people) await page.getByRole("button", { name: "Good" }).waitFor({ timeout: PATIENCE_MS });
  await people[0].getByText("It has ended: finished").waitFor();
  if (looked) await pictures(people[0], "mark");
  for (const [index, page] of people.entries()) await page.getByRole("button", { name: marks[index] }).click();
}

const first = await collect("2000-2001");
const overview = await open(first.links[2]);
await overview.getByRole("link", { name: "Drive robot B" }).waitFor();
await overview.locator("summary").first().click();
await pictures(overview, "overview");
let people = await Promise.all(first.links.slice(0, 2).map((link) => open(link)));
await people[0].getByRole("button", { name: "Begin" }).waitFor();
assert.ok(!people[0].url().includes("token"), "the token is still in the address");
await people[0].getByText("Take the bottle in front of you").waitFor();
await pictures(people[0], "begin");
await play(people, ["Good", "Good"], true);
await play(people, ["Good", "Bad"], false);
await people[1].getByText("That was the last one").waitFor();
await first.ended;
assert.ok(existsSync(join(out, "episodes/handover-2000/good")));
assert.equal(readFileSync(join(`${out}-bad`, "handover-2001/bad"), "utf8"), "marked bad by B\n");

const second = await collect("2000-2001");
people = await Promise.all(second.links.slice(0, 2).map((link) => open(link)));
await people[0].getByRole("heading", { name: "Episode 2 of 2: handover, seed 2001" }).waitFor();
await play(people, ["Good", "Good"], false);
await second.ended;
assert.ok(existsSync(join(out, "episodes/handover-2001/good")));
await done();
