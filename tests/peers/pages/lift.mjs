// Three operators lift BigTable. Each sends setpoints for its robot 50 times a second over the socket of the pages. The setpoints come from
// the experts, who play an episode first. No browser is needed.
//
//     node REPOSITORY/tests/peers/pages/lift.mjs REPOSITORY/target/release/tandem
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { join } from "node:path";
import { deadline, post, program, serve } from "./shared/server.mjs";
import { driver } from "./shared/socket.mjs";

const CONTROL_HZ = 50;
/** Maximum time of the lift, which is longer than the experts take. */
const MOST_S = 60;
deadline(5);

const { link, base, runs } = await serve();
const key = { authorization: `Bearer ${new URL(link).hash.slice(1)}` };
const begin = () => post(base, "/v1/episodes", { task: "big_table", seed: 2000, protocol: "agentic", operators: "per_robot", patience_s: 600 });
const stands = async (id) => (await fetch(`${base}/v1/episodes/${id}`)).json();
const remove = async (id) => (await fetch(`${base}/v1/episodes/${id}`, { method: "DELETE" })).json();
const passed = (ms) => new Promise((done) => setTimeout(done, ms));

// The experts play, each for its own robot, until the table is lifted.
const theirs = await begin();
for (const { robot } of theirs.operators) await post(base, "/operate/expert", { episode: theirs.episode_id, robot });
while (!(await stands(theirs.episode_id)).phases?.length) await passed(200);
const shown = await remove(theirs.episode_id);
console.log(`the experts lift it after ${shown.phases.p1} s`);
const recorded = await (await fetch(`${base}/watch/run?run=${theirs.episode_id}`, { headers: key })).arrayBuffer();
const { story } = JSON.parse(new TextDecoder().decode(recorded.slice(4, 4 + new DataView(recorded).getUint32(0, true))));

/** Commands of a robot by its expert, with their start and end times. */
function toldOf(robot) {
  return story.filter(({ tool, ok }) => tool === "together" && ok).flatMap(({ arguments: given, reply, time_s: until }) => {
    const own = JSON.parse(given).commands.find((command) => command.robot === robot);
    const from = until - JSON.parse(reply).executed_steps / CONTROL_HZ;
    const [move] = own?.arguments.robots ?? [];
    if (!move) return [];
    const said = Object.entries(move).filter(([name, value]) => name !== "robot" && value !== null);
    return [{ from, until, move: Object.fromEntries(said) }];
  });
}

/** Returns the setpoints at a moment. Wrists move on their lines from their last targets. */
function wordAt(told, time_s) {
  const index = told.findLastIndex(({ from }) => from <= time_s + 1e-6);
  if (index < 0) return {};
  const { from, until, move } = told[index];
  const before = told[index - 1]?.move ?? move;
  const share = Math.min(1, (time_s + 1 / CONTROL_HZ - from) / (until - from));
  const between = (name) => before[name] && move[name] && move[name].map((value, axis) => before[name][axis] + share * (value - before[name][axis]));
  const wrists = ["left_position_m", "right_position_m"].map((name) => [name, between(name) ?? move[name]]);
  return { ...move, ...Object.fromEntries(wrists.filter(([, value]) => value)) };
}

const ours = await begin();
const people = await Promise.all(ours.operators.map(({ robot, token }) => driver(base, robot, token)));
const told = people.map(({ robot }) => toldOf(robot));
const following = setInterval(() => people.forEach((one, index) => { one.move = wordAt(told[index], one.time()); }), 5);
const began = performance.now();
let reached = [];
while (!reached.length && performance.now() - began < 1000 * MOST_S) {
  await passed(200);
  reached = (await stands(ours.episode_id)).phases ?? [];
}
clearInterval(following);
people.forEach((one) => one.leave());
const result = await remove(ours.episode_id);
console.log(`three operators lift it after ${result.phases.p1} s, with ${result.falls} falls, ${result.tool_calls} calls`);
assert.ok(reached.length > 0, "the table is not lifted");
console.log(execFileSync(program, ["replay", join(runs, ours.episode_id, "episode.mcap"), "--verify"], { encoding: "utf8" }).trim());
process.exit(0);
