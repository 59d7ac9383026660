// Filters over finished episodes, and the lines that connect an agent: `npm test`.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { test } from "node:test";
import { chosenIn, counted, filtered, policyOf, withChoice } from "../home/filters.js";
import { waysToConnect } from "../home/lines.js";

const NOW_S = 1_000_000;
const entry = (run, task, phases, policy, agoS) => ({
  run,
  policy,
  ended_unix_s: NOW_S - agoS,
  result: {
    task,
    seed: 2000,
    protocol: "agentic",
    ended: "task_complete",
    env_steps: 500,
    tool_calls: 3,
    falls: 0,
    phases: Object.fromEntries(phases.map((time, index) => [`p${index + 1}`, time])),
  },
});
const ENTRIES = [
  entry("a", "handover", [1, 2, 3], "expert", 10),
  entry("b", "handover", [1, null, null], "idle", 4000),
  entry("c", "co_carry", [null, null, null], null, 100_000),
  entry("d", "co_carry", [1, 2, 3], "expert", 3_000_000),
];
const NONE = chosenIn("");
const runs = (choice) =>
  filtered(ENTRIES, { ...NONE, ...choice }, NOW_S)
    .map(({ run }) => run)
    .join("");

test("each filter lets through what fits it", () => {
  for (const [choice, expected] of [
    [{}, "abcd"],
    [{ task: "handover" }, "ab"],
    [{ policy: "expert" }, "ad"],
    [{ policy: "not named" }, "c"],
    [{ result: "success" }, "ad"],
    [{ result: "some" }, "b"],
    [{ result: "none" }, "c"],
    [{ age: "hour" }, "a"],
    [{ age: "day" }, "ab"],
    [{ age: "week" }, "abc"],
    [{ text: "CO carry" }, "cd"],
    [{ text: "co_carry expert" }, "d"],
    [{ text: "seed 2000" }, "abcd"],
    [{ text: "nothing" }, ""],
    [{ task: "handover", policy: "expert", result: "some" }, ""],
  ])
    assert.equal(runs(choice), expected, JSON.stringify(choice));
  assert.deepEqual(counted(ENTRIES, policyOf), [
    ["expert", 2],
    ["idle", 1],
    ["not named", 1],
  ]);
});

test("a choice goes through an address, beside what else is in it", () => {
  const choice = { text: "seed 20 & more", task: "handover", policy: "", result: "some", age: "" };
  const query = withChoice("?other=1&policy=old", choice);
  assert.deepEqual(chosenIn(query), choice);
  assert.equal(new URLSearchParams(query).get("other"), "1");
  assert.equal(withChoice("?text=a", NONE), "");
});

/** Fails unless a program accepts the text on its standard input. */
function parses(program, words, input) {
  const { status, stderr, error } = spawnSync(program, words, { input, encoding: "utf8" });
  if (error && "code" in error && error.code === "ENOENT") console.log(`skipped: ${program} is not installed`);
  else assert.equal(status, 0, `${input}\n${stderr}`);
}

test("lines to copy are a shell's, Python's or JSON", () => {
  for (const locked of [false, true]) {
    for (const episode of [undefined, "handover-seed7"]) {
      const ways = waysToConnect({ url: "http://127.0.0.1:8700", locked, task: "handover", seed: 7, episode });
      assert.equal(ways.length, 6);
      for (const { name, text } of ways) {
        assert.ok(text.includes("http://127.0.0.1:8700"), name);
        assert.doesNotMatch(text, /null|undefined/);
        assert.equal(
          text.includes("TANDEM_TOKEN"),
          locked && !["Python", "A language model"].includes(name),
          `${name}: ${text}`,
        );
        if (name.startsWith("Other"))
          assert.equal(JSON.parse(text).mcpServers.tandem.url, "http://127.0.0.1:8700/mcp");
        else if (name === "Python")
          parses("python3", ["-c", "import ast, sys; ast.parse(sys.stdin.read())"], text);
        else parses("sh", ["-n"], text);
      }
      const rest = ways.find(({ name }) => name === "REST");
      assert.ok(rest);
      assert.equal(rest.text.includes('"seed":7'), !episode, "an episode that runs is not started again");
    }
  }
});
