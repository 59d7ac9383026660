// The start page in a headless Chromium: an episode is started and played by the lines to copy, the watch link
// is entered, finished episodes are filtered, two are played side by side, and a server with a token asks for
// it. shared/browser.mjs describes how to run it.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { join } from "node:path";
import { accessible, done, open, pictures, program, run, serve } from "./shared/browser.mjs";

const TOKEN = "correct-horse-battery-staple";
const { link, base, runs } = await serve();
const played = async (...words) => {
  await (
    await run(words, /./)
  ).ended;
};

// A visitor without the watch link sees tasks and lines, and starts an episode.
const page = await open(base);
const task = (id) => page.locator(".task", { has: page.getByRole("heading", { name: id, exact: true }) });
await task("handover").waitFor();
assert.ok((await page.locator(".task").count()) >= 15);
await page.getByText("None runs.").waitFor();
assert.equal(await page.getByRole("heading", { name: "Finished" }).isVisible(), false);
await task("handover").locator("img[src]").waitFor();
await accessible(page, "the start page");
await page.getByLabel("Seed").fill("7");
await page.getByRole("button", { name: "Start handover" }).click();
await page.getByText("handover-seed7 waits for its first command.").waitFor();
await page.locator("#running .card", { hasText: "handover-seed7" }).waitFor();

// The lines work.
const lines = await page.getByLabel("Lines for REST").innerText();
const { status, stdout } = spawnSync("sh", ["-ec", lines], { encoding: "utf8" });
assert.ok(status === 0 && stdout.includes('"executed_steps"'), `${lines}\n${stdout}`);
await page.locator("#running .card", { hasText: "step 325" }).waitFor();

// With the watch link the page shows all sections.
await page.getByLabel(/watch link/).fill("not the link");
await page.getByRole("button", { name: "Open" }).click();
await page.getByText("That is not this server's link").waitFor();
await page.getByLabel(/watch link/).fill(link);
await page.getByRole("button", { name: "Open" }).click();
await page.locator("#running .picture img").waitFor();
await page.getByText("None yet.").waitFor();
await played(
  "evaluate",
  "--policy",
  "idle",
  "--tasks",
  "handover,table_align",
  "--seeds",
  "2000-2001",
  "--protocol",
  "benchmark",
  "--jobs",
  "1",
  "--record",
  "--out",
  join(runs, "idle"),
);
await played("demo", "--seeds", "2001", "--runs", runs);
await page.getByText("5 episodes", { exact: true }).waitFor();

// Filters narrow the list, and are in the address.
const cards = page.locator("#finished .card");
const shown = async (count, of) => {
  await page.getByText(`${count} of ${of} episodes`).waitFor();
  assert.equal(await cards.count(), count);
};
await page.locator("select[name=policy]").selectOption("idle");
await shown(4, 5);
await page.locator("#finished select[name=task]").selectOption("table_align");
await shown(2, 5);
await page.getByLabel("Find").fill("2001");
await shown(1, 5);
await page.reload();
await shown(1, 5);
assert.match(await cards.first().innerText(), /Table align[^]*idle, seed 2001/i);
await page.getByRole("button", { name: "Clear" }).click();
await page.getByText("5 episodes", { exact: true }).waitFor();
await page.locator("select[name=result]").selectOption("success");
await shown(1, 5);
await page.getByRole("button", { name: "Clear" }).click();
await pictures(page, "start", { settleMs: 800 });

// Two episodes on one clock, chosen by the keyboard.
for (const name of [
  "handover, seed 2001, handover-seed2001",
  "handover, seed 2001, idle/episodes/handover-2001",
]) {
  await page.getByRole("button", { name: `Compare ${name}` }).focus();
  await page.keyboard.press("Enter");
}
await page.getByRole("link", { name: "Play side by side" }).focus();
await page.keyboard.press("Enter");
await page.locator(".beside canvas").nth(1).waitFor();
await page.locator(".track input").fill("12");
await page.getByText(/^12\.00 of/).waitFor();
assert.equal(await page.locator(".beside .phases .done").count(), 1, "the first phase of the demo");
await page.waitForURL(/at=12\.00/);
await accessible(page, "two episodes");
await pictures(page, "beside", { settleMs: 1500 });
await page.locator(".play").click();
await page.getByText(/^12\.[1-9]/).waitFor();

// The address of a moment opens the page at that moment.
await page.goto(`${base}/watch?run=handover-seed2001`);
await page.locator(".track input").fill("3.5");
await page.waitForURL(/at=3\.50/);
await page.reload();
await page.getByText(/^3\.50 of/).waitFor();

// A server with a token asks for it, and its lines name the variable that contains it.
const guarded = spawn(program, ["serve", "--listen", "127.0.0.1:0", "--runs", runs], {
  env: { ...process.env, TANDEM_TOKEN: TOKEN },
  stdio: ["ignore", "pipe", "ignore"],
});
process.on("exit", () => guarded.kill());
const address = await new Promise((resolve) => {
  guarded.stdout.on(
    "data",
    (said) => /http:[^/]*\/\/[^/\s]+/.test(said) && resolve(String(said).match(/http:[^/]*\/\/[^/\s]+/)[0]),
  );
});
const outside = await open(address);
await outside.getByLabel("The server's token").fill(TOKEN);
await outside.getByRole("button", { name: "Open" }).first().click();
await outside.locator(".task img[src]").first().waitFor();
assert.match(await outside.getByLabel("Lines for REST").innerText(), /Bearer \$TANDEM_TOKEN/);
await accessible(outside, "the start page of a server with a token");
await outside.getByRole("button", { name: "Start handover" }).click();
await outside.getByText(/waits for its first command/).waitFor();
await done();
