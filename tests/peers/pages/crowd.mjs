// 20 people watch and three drive BigTable for ten minutes, one episode after another. All watchers open each episode again once it is
// over, and all of them ten times at the end. The server's memory does not grow, and no command is dropped. No browser is needed.
//
//     node REPOSITORY/tests/peers/pages/crowd.mjs REPOSITORY/target/release/tandem [MINUTES]
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { post, serve } from "./shared/server.mjs";
import { driver, watcher } from "./shared/socket.mjs";

const minutes = Number(process.argv[3] ?? 10);
const WATCHERS = 20;
/** Number of times that all episodes are opened again at the end. */
const ROUNDS = 10;
/** Minimum duration of an episode, because its beginning is not typical of its memory. */
const LEAST_MS = 20_000;
const { link, base, server } = await serve();
const key = new URL(link).hash.slice(1);
const megabytes = () => Number(readFileSync(`/proc/${server.pid}/status`, "utf8").match(/VmRSS:\s+(\d+)/)[1]) / 1024;

const began = performance.now();
const memory = [];
const episodes = [];
const refusals = new Set();
const total = { steps: 0, rows: 0, seen: 0, refused: 0, recorded: 0 };
let rate = 1;
const look = async (id) => (await fetch(`${base}/watch/run?run=${id}`, { headers: { authorization: `Bearer ${key}` } })).arrayBuffer();
for (let seed = 2000; 60_000 * minutes - (performance.now() - began) > LEAST_MS; seed += 1) {
  const started = await post(base, "/v1/episodes", { task: "big_table", seed, operators: "per_robot", patience_s: 600, talk: true });
  const id = started.episode_id;
  episodes.push(id);
  const people = await Promise.all(started.operators.map(({ robot, token }) => driver(base, robot, token)));
  const watching = await Promise.all(Array.from({ length: WATCHERS }, () => watcher(base, id, key)));
  const homes = people.map((one) => one.poses());
  const clock = performance.now();
  const wave = setInterval(() => people.forEach((one, index) => {
    const up = 0.05 * Math.sin(performance.now() / 500);
    const at = (side) => homes[index][side].position.map((value, axis) => value + (axis === 2 ? up : 0));
    one.move = { carried: true, left_position_m: at("left"), right_position_m: at("right") };
  }), 20);
  const last = Math.min(110_000, 60_000 * minutes - (performance.now() - began));
  await new Promise((passed) => setTimeout(passed, last));
  clearInterval(wave);
  const time = people[0].time();
  rate = Math.min(rate, time / ((performance.now() - clock) / 1000));
  people.forEach((one) => { one.go = false; });
  await new Promise((passed) => setTimeout(passed, 1000));
  for (const one of people) {
    total.rows += one.rows;
    one.told.filter(({ kind }) => kind === "refused").forEach(({ detail }) => refusals.add(detail));
    total.refused += one.told.filter(({ kind }) => kind === "refused").length;
    assert.ok(one.told.every(({ kind }) => kind !== "replaced"));
  }
  const status = await (await fetch(`${base}/v1/episodes/${id}`)).json();
  const steps = status.env_steps - started.status.env_steps;
  total.steps += steps;
  total.seen += watching.reduce((sum, one) => sum + one.steps, 0) / WATCHERS;
  assert.ok(watching.every((one) => one.open), "who watches stays");
  console.log(`${((performance.now() - began) / 60_000).toFixed(1)} min: ${megabytes().toFixed(0)} MB, ${steps} steps, ${(time / ((performance.now() - clock) / 1000)).toFixed(2)} of real time`);
  people.forEach((one) => one.leave());
  watching.forEach((one) => one.leave());
  await fetch(`${base}/v1/episodes/${id}`, { method: "DELETE" });
  const [recording] = await Promise.all(Array.from({ length: WATCHERS }, () => look(id)));
  memory.push(megabytes());
  // The recording has a command of each robot for every step.
  const { story } = JSON.parse(new TextDecoder().decode(recording.slice(4, 4 + new DataView(recording).getUint32(0, true))));
  for (const { tool, ok, arguments: asked, reply } of story.filter((entry) => entry.tool === "together")) {
    assert.ok(ok, reply);
    const robots = JSON.parse(asked).commands.map((command) => command.robot);
    assert.deepEqual(robots, ["A", "B", "C"], tool);
    total.recorded += JSON.parse(reply).executed_steps;
  }
}
console.log(`${total.steps} steps, each told ${(total.rows / total.steps).toFixed(2)} times to three drivers, ${total.recorded} with three commands each in the recordings; ${total.refused} refused; a watcher saw ${(total.seen / total.steps).toFixed(2)} of them; at least ${rate.toFixed(2)} of real time; memory after each episode ${memory.map((value) => value.toFixed(0)).join(", ")} MB`);
const rounds = [];
for (let round = 0; round < ROUNDS; round += 1) {
  for (const id of episodes) await Promise.all(Array.from({ length: WATCHERS }, () => look(id)));
  rounds.push(megabytes());
}
console.log(`all looked at again by ${WATCHERS}, ${ROUNDS} times: ${rounds.map((value) => value.toFixed(0)).join(", ")} MB`);
assert.equal(total.refused, 0, JSON.stringify([...refusals]));
assert.equal(total.recorded, total.steps, "a command is missing");
assert.ok(memory.at(-1) < 1.1 * memory[Math.min(1, memory.length - 1)], "memory grows");
const half = ROUNDS / 2;
assert.ok(Math.max(...rounds.slice(half)) < 1.1 * Math.max(...rounds.slice(0, half)), "memory grows from look to look");
process.exit(0);
