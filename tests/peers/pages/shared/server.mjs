// The program as a server, for the scripts beside this folder.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** Ends the script, and what it has started, where it is not through by then: nobody waits for a page that hangs. */
export function deadline(minutes) {
  setTimeout(() => {
    console.error(`not through after ${minutes} minutes`);
    process.exit(1);
  }, 60_000 * minutes).unref();
}

/** The program that is tried. */
export const [program] = process.argv.slice(2);

/** A folder of its own for what a server leaves. */
export const folder = (name) => mkdtempSync(join(tmpdir(), `${name}-`));

/** Runs the program until this one ends. Returns what it says up to `last` on its standard output, and what tells that it has ended. */
export async function run(words, last) {
  const running = spawn(program, words, { stdio: ["ignore", "pipe", "ignore"] });
  process.on("exit", () => running.kill());
  const ended = new Promise((done) => running.on("exit", done));
  let said = "";
  /** @type {Promise<void>} */
  const told = new Promise((resolve, failed) => {
    running.stdout.on("data", (data) => {
      said += data;
      if (last.test(said)) resolve();
    });
    ended.then((code) => failed(new Error(`${words[0]} ended with ${code}`)));
  });
  await told;
  return { said, ended, process: running };
}

/** Starts a server. Returns the link for those who watch, its origin, and the folder of its runs. */
export async function serve(...words) {
  const runs = folder("runs");
  const { said, process: server } = await run(["serve", "--listen", "127.0.0.1:0", "--runs", runs, ...words], /watch at \S+\n/);
  const [, link] = said.match(/watch at (\S+)\n/);
  return { link, base: new URL(link).origin, runs, server };
}

/** What a server answers to a call. */
export async function post(base, path, body, token) {
  const headers = { "content-type": "application/json", ...(token ? { authorization: `Bearer ${token}` } : {}) };
  const answer = await fetch(base + path, { method: "POST", headers, body: JSON.stringify(body) });
  assert(answer.ok, `${path}: ${await answer.clone().text()}`);
  return answer.status === 204 ? null : answer.json();
}
