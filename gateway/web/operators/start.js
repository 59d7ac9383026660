// The start of an episode whose robots people drive: what is played, and a link for each person.

import { element, words } from "../src/dom.js";
import { call } from "./call.js";
import { linkRow } from "./links.js";

/** The longest that an episode may wait for somebody who is away. */
const PATIENCE_S = 600;

const labelled = (text, field) => element("p", {}, element("label", {}, `${text} `, field));

/** Who may drive a robot. */
const PLAYERS = [
  ["person", "a person"], ["expert", "the task's expert, a script that sees everything"], ["program", "a program or an agent of yours"],
  ["still", "nobody: it stands still"],
];

/** Shows the form: of a new episode, or of one that goes on where `from`, a finished one, stood at a moment. */
export function start(main, from = null) {
  const task = element("select", { name: "task", required: true });
  const seed = element("input", { name: "seed", type: "number", min: 0, max: 4294967295, step: 1, value: 0, required: true });
  const protocol = element("select", { name: "protocol" },
    element("option", { value: "agentic" }, "of agents: more time, and a wall clock"), element("option", { value: "benchmark" }, "of the benchmark: little time"));
  const token = element("input", { name: "token", type: "password", autocomplete: "off" });
  const players = element("div");
  const refusal = element("p", { class: "bad", role: "alert" });
  const links = element("div");
  let tasks = [];

  const offer = () => {
    const robots = "ABC".slice(0, robotCount(tasks.find(({ id }) => id === task.value)));
    players.replaceChildren(...[...robots].map((robot) => labelled(`Robot ${robot} is driven by`,
      element("select", { name: robot }, ...PLAYERS.map(([value, told]) => element("option", { value }, told))))));
  };
  const load = async () => {
    refusal.textContent = "";
    try {
      ({ tasks } = await call("/v1/tasks", token.value));
    } catch (error) {
      refusal.textContent = error.status === 401 ? "This server wants its token: enter it above." : error.message;
      return;
    }
    const offered = from ? tasks.filter(({ id }) => id === from.task) : tasks;
    task.replaceChildren(...offered.map(({ id, instruction }) => element("option", { value: id, title: instruction }, id)));
    offer();
  };
  task.addEventListener("change", offer);
  token.addEventListener("change", load);

  const begin = async (event) => {
    event.preventDefault();
    refusal.textContent = "";
    const chosen = new FormData(event.target);
    if (!["A", "B", "C"].some((robot) => chosen.get(robot) === "person")) {
      refusal.textContent = "Somebody has to drive a robot: choose a person for one of them.";
      return;
    }
    const body = { task: task.value, seed: Number(seed.value), protocol: protocol.value, short: true, operators: "per_robot", patience_s: PATIENCE_S, talk: true };
    try {
      const started = from
        ? await call("/watch/take_over", token.value, { run: from.run, time_s: Number(from.at), protocol: protocol.value }, { credentials: "same-origin" })
        : await call("/v1/episodes", token.value, body);
      links.replaceChildren(...await linksOf(started, chosen, token.value));
      links.scrollIntoView({ block: "nearest" });
    } catch (error) {
      refusal.textContent = error.message;
    }
  };
  const what = from
    ? element("p", {}, `Goes on where ${from.run} stood at ${Number(from.at).toFixed(1)} s: ${words(from.task)}, seed ${from.seed}. It becomes an episode of its own, with a whole budget ahead.`)
    : null;
  if (from) protocol.value = from.protocol;
  main.replaceChildren(
    element("p", {}, element("a", { href: "/" }, "All episodes")),
    element("h1", {}, from ? "Take over" : "Operate robots together"),
    element("p", {}, "Each person drives one robot, on a page of their own. Time passes while everybody's page is open and in view, and stands still while one is away."),
    element("form", { onsubmit: begin, class: "operate-form" }, what ?? labelled("Task", task), from ? "" : labelled("Seed", seed), labelled("Rules", protocol), players,
      labelled("The server's token, if it has one", token), element("button", {}, "Start"), refusal),
    links);
  load();
}

const robotCount = (task) => task?.robots?.length ?? 2;

/**
 * The links of an episode that has begun, and what programs need. Whoever drives the first robot also lets those stand still that nobody
 * drives.
 */
async function linksOf({ episode_id: episode, operators, instructions }, chosen, hostToken) {
  const by = (player) => operators.filter(({ robot }) => chosen.get(robot) === player);
  const [people, still] = [by("person"), by("still")];
  await Promise.all(by("expert").map(({ token }) => call("/operate/expert", token, {})));
  const part = (robot) => instructions.find((entry) => entry.robot === robot)?.instruction ?? "";
  const rows = people.map(({ robot, token }, index) => {
    const seat = new URLSearchParams({ episode, robot, token });
    if (index === 0 && still.length > 0) seat.set("still", still.map(({ robot: name, token: own }) => `${name}.${own}`).join(","));
    return linkRow(`Drive robot ${robot}`, `${location.origin}/operate#${seat}`, hostToken, part(robot));
  });
  return [element("h2", {}, "Links"),
    element("p", {}, "Send each person one of these, and nobody else: who has the link drives the robot. They are shown this once."),
    element("ul", { class: "links" }, ...await Promise.all(rows)),
    ...by("program").flatMap(({ robot, token }) => [
      element("h2", {}, `Robot ${robot}'s program`),
      element("p", {}, "Start it with this in its environment, or give an agent the address and the token. It commands by HTTP or MCP as ever; time stands still while it thinks."),
      element("pre", {}, [`TANDEM_URL=${location.origin}`, `TANDEM_EPISODE=${episode}`, `TANDEM_ROBOT=${robot}`, `TANDEM_TOKEN=${token}`].join("\n")),
    ]),
    ...by("expert").map(({ robot }) => element("p", {}, `The expert drives robot ${robot} as soon as somebody else commands.`))];
}
