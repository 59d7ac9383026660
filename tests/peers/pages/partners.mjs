// From the start page at /operate, a person drives robot B beside an expert who drives A, and then beside a learned policy, which is
// served at `/act`: your own, or a test policy that raises A's right arm. shared/browser.mjs describes how to run it.
//
//     node REPOSITORY/tests/peers/pages/partners.mjs REPOSITORY/target/release/tandem [ACT_URL MAP]
import { execFileSync } from "node:child_process";
import { once } from "node:events";
import { createServer } from "node:http";
import { join } from "node:path";
import { PATIENCE_MS, done, open, pictures, program, serve } from "./shared/browser.mjs";
import { hear, inPages, poses } from "./shared/rows.mjs";

/** Returns rows with the present joints, except for a right arm that is raised from row to row. */
async function madeUp() {
  const server = createServer((request, answer) => {
    let body = "";
    request.on("data", (data) => { body += data; });
    request.on("end", () => {
      const { __numpy__: bytes } = JSON.parse(body)["observation/state"];
      const joints = new Float32Array(Uint8Array.from(Buffer.from(bytes, "base64")).buffer);
      // Order of the request: legs, waist, left arm and hand, right arm and hand. Order of the answer: arms, hands, waist, base.
      const [waist, leftArm, leftHand, rightArm, rightHand] = [[12, 15], [15, 22], [22, 29], [29, 36], [36, 43]].map((range) => [...joints.slice(...range)]);
      const held = [...leftArm, ...rightArm, ...leftHand, ...rightHand, ...waist, 0, 0, 0, 0.76];
      const rows = Array.from({ length: 10 }, (_, row) => held.map((value, column) => (column === 7 ? value - 0.01 * (row + 1) : value)));
      answer.setHeader("content-type", "application/json");
      answer.end(JSON.stringify({ actions: rows }));
    });
  });
  server.listen(0, "127.0.0.1");
  await once(server, "listening");
  const { port } = /** @type {import("node:net").AddressInfo} */ (server.address());
  return [`http://127.0.0.1:${port}/act`, "openpi"];
}

const given = process.argv.slice(3);
const [url, map] = given.length === 2 ? given : await madeUp();
const { base, runs } = await serve("--partner", `act:${url}`, "--partner-map", map);

/** Starts Handover with `player` for A, and drives B. Returns B's page. */
async function beside(player, seed) {
  const starter = await open(`${base}/operate`);
  await starter.locator("option[value=handover]").waitFor({ state: "attached" });
  await starter.locator("select[name=task]").selectOption("handover");
  await starter.locator("input[name=seed]").fill(String(seed));
  await starter.locator("select[name=A]").selectOption(player);
  await pictures(starter, `start-${player}`);
  await starter.getByRole("button", { name: "Start" }).click();
  const link = await starter.getByRole("link", { name: "Drive robot B" }).getAttribute("href");
  await pictures(starter, `links-${player}`);
  await starter.context().close();
  const page = await open(link, { before: [hear, inPages] });
  await page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: PATIENCE_MS });
  const episode = new URLSearchParams(link.split("#")[1]).get("episode");
  return { page, episode };
}

/** Ends an episode, checks that the replay of its recording is identical, and returns its result. */
async function end({ page, episode }) {
  await page.context().close();
  const result = await (await fetch(`${base}/v1/episodes/${episode}`, { method: "DELETE" })).json();
  const told = execFileSync(program, ["replay", join(runs, episode, "episode.mcap"), "--verify"], { encoding: "utf8" });
  console.log(told.trim().split("\n")[0]);
  return result;
}

const expert = await beside("expert", 2000);
await expert.page.getByText("reached: grasp and lift").waitFor({ timeout: 2 * PATIENCE_MS });
await expert.page.keyboard.down("w");
await expert.page.waitForTimeout(500);
await expert.page.keyboard.up("w");
await expert.page.screenshot({ path: "beside-expert.png" });
const { phases } = await end(expert);
console.log(`beside the expert: grasp and lift at ${phases.p1.toFixed(1)} s`);

const policy = await beside("policy", 1);
const wrist = () => policy.page.evaluate(() => window.posesIn(window.head, window.rows.at(-1).row, "A").right.position);
const before = await wrist();
if (given.length === 2) await policy.page.getByText("reached: grasp and lift").waitFor({ timeout: 2 * PATIENCE_MS });
else await policy.page.waitForFunction((from) => {
  const now = window.posesIn(window.head, window.rows.at(-1).row, "A").right.position;
  return Math.hypot(...now.map((value, axis) => value - from[axis])) > 0.05;
}, before);
const after = await wrist();
await policy.page.screenshot({ path: "beside-policy.png" });
console.log(`beside the policy, A's wrist moved ${Math.hypot(...after.map((value, axis) => value - before[axis])).toFixed(3)} m; B stands at ${(await poses(policy.page)).time_s.toFixed(1)} s`);
const result = await end(policy);
console.log(`phases ${JSON.stringify(result.phases)}`);
await done();
