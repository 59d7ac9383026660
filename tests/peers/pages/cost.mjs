// Cost of three watchers for an episode: the same calls with and without them, alternately, reach the same state and take as long. No
// browser is needed, because the watchers only listen. The machine has to be idle.
//
//     node REPOSITORY/tests/peers/pages/cost.mjs REPOSITORY/target/release/tandem
import assert from "node:assert/strict";
import { once } from "node:events";
import { Worker } from "node:worker_threads";
import { post, serve } from "./shared/server.mjs";

const PAIRS = 8;
const CALLS = 200;
const STEPS = 25;
const WATCHERS = 3;

const { link, base } = await serve();
const key = new URL(link).hash.slice(1);

/** Plays an episode. Returns control steps a second, and the final state. */
async function play(watchers) {
  const { episode_id: id } = await post(base, "/v1/episodes", { task: "handover", seed: 2000 });
  const watching = new Worker(new URL("./shared/watchers.mjs", import.meta.url), { workerData: { base, episode: id, key, count: watchers } });
  await once(watching, "message");
  const began = performance.now();
  for (let call = 0; call < CALLS; call += 1) {
    const up = 0.1 + 0.05 * Math.sin(call / 10);
    await post(base, `/v1/episodes/${id}/tools/move_wrists`, { steps: STEPS, robots: ["A", "B"].map((robot) => ({ robot, right_position_m: [0.25, -0.2, up] })) });
  }
  const rate = (CALLS * STEPS) / ((performance.now() - began) / 1000);
  const { state_hash: hash } = await (await fetch(`${base}/v1/episodes/${id}`, { method: "DELETE" })).json();
  watching.postMessage("enough");
  const [seen] = await once(watching, "message");
  assert.ok(seen.every((steps) => steps > CALLS), "they see it");
  await watching.terminate();
  return { rate, hash };
}

await play(0);
const shares = [];
const hashes = new Set();
for (let pair = 0; pair < PAIRS; pair += 1) {
  // The order alternates, so that changes over time affect both.
  const order = pair % 2 ? [WATCHERS, 0] : [0, WATCHERS];
  const rates = {};
  for (const watchers of order) {
    const { rate, hash } = await play(watchers);
    rates[watchers] = rate;
    hashes.add(hash);
  }
  shares.push(1 - rates[WATCHERS] / rates[0]);
  console.log(`${rates[0].toFixed(0)} steps a second alone, ${rates[WATCHERS].toFixed(0)} with ${WATCHERS} who watch`);
}
const sorted = shares.toSorted((one, other) => one - other);
const middle = (sorted[PAIRS / 2 - 1] + sorted[PAIRS / 2]) / 2;
console.log(`watching takes ${(100 * middle).toFixed(1)} % (median of ${PAIRS} pairs, ${(100 * sorted[0]).toFixed(1)} to ${(100 * sorted.at(-1)).toFixed(1)} %); ${hashes.size} state`);
assert.equal(hashes.size, 1, "the same calls come to the same state");
process.exit(0);
