// `tandem collect --operators 2` with two people without browsers. They play ten episodes over the pages' socket, with HTTPS
// if certificate and key are given, and mark them good. The folder has the same form as the experts' folders.
//
//     node REPOSITORY/tests/peers/pages/people.mjs REPOSITORY/target/release/tandem OUT [CERTIFICATE KEY]
import assert from "node:assert/strict";
import { existsSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { run } from "./shared/server.mjs";
import { driver } from "./shared/socket.mjs";

const [, , , out, certificate, key] = process.argv;
const EPISODES = 10;
// The certificate is self-signed.
if (certificate) process.env.NODE_TLS_REJECT_UNAUTHORIZED = "0";
const secured = certificate ? ["--tls-cert", certificate, "--tls-key", key] : [];
const flags = ["--operators", "2", "--tasks", "handover", "--protocol", "benchmark", "--renderer", "cpu", "--seeds", `0-${EPISODES - 1}`, "--out", out];
const { said, ended } = await run(["collect", ...flags, ...secured], /watch at/);
const links = [...said.matchAll(/^robot \w: (\S+)$/gm)].map(([, link]) => new URL(link));
assert.ok(links.every(({ protocol }) => protocol === (certificate ? "https:" : "http:")), said);
const [{ origin: base }] = links;
const passed = (ms) => new Promise((done) => setTimeout(done, ms));

/** Acts as one of the people until all episodes are complete. */
async function play(seat) {
  const { robot, token } = Object.fromEntries(new URLSearchParams(seat.hash.slice(1)));
  const headers = { authorization: `Bearer ${token}`, "content-type": "application/json" };
  const call = async (path, body) => (await fetch(base + path, { method: body ? "POST" : "GET", headers, body: body && JSON.stringify(body) })).json();
  for (let played = 0; ;) {
    const { stage, episode, marks, robots } = await call("/operate/collection").catch(() => ({ stage: "over" }));
    if (stage === "over") return;
    if (stage === "playing" && episode.number > played) {
      const own = await driver(base, robot, token);
      const home = own.poses().right.position;
      own.move = { carried: true, right_position_m: home.map((value, axis) => value + [0.1, 0, 0.05][axis]) };
      while (own.time() < 1) await passed(50);
      own.leave();
      while ((await call(`/v1/episodes/${episode.episode_id}/tools/finish`, {})).status === 409) await passed(100);
      played = episode.number;
    } else if (stage === "marking" && marks[robots.indexOf(robot)] === null) {
      await call("/operate/mark", { good: true });
    } else {
      await passed(100);
    }
  }
}

await Promise.all(links.map(play));
await ended;
const folders = readdirSync(join(out, "episodes")).filter((name) => !name.endsWith(".json"));
assert.equal(folders.length, EPISODES);
assert.ok(folders.every((name) => ["good", "episode.mcap", "result.json"].every((file) => existsSync(join(out, "episodes", name, file)))));
console.log(`${EPISODES} episodes of two people over ${certificate ? "HTTPS" : "HTTP"}: ${folders.join(", ")}`);
process.exit(0);
