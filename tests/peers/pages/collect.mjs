// `tandem collect --operators 2` in a headless Chromium: whoever runs it opens the page with all links, two people follow theirs, play
// two episodes, mark one bad, and run the command again; and pictures of all pages for somebody to look at. How it is run is said in
// shared/browser.mjs.
import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { PATIENCE_MS, done, folder, open, pictures, run } from "./shared/browser.mjs";

const out = join(folder("collect"), "people");

/** Runs the command; answers with its links, and with what tells that it has ended. */
async function collect(seeds) {
  const flags = ["--operators", "2", "--tasks", "handover", "--protocol", "benchmark", "--renderer", "cpu", "--seeds", seeds, "--out", out];
  const { said, ended } = await run(["collect", ...flags], /watch at/);
  return { links: [...said.matchAll(/^(?:robot \w|all links): (\S+)$/gm)].map(([, link]) => link), ended };
}

/** Both begin, drive for a moment, finish, and mark the episode. */
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
