// The start of an episode whose robots people drive: the choice of the episode, and a link for each person.

import { element, reasonOf, say, words } from "../src/dom.js";
import { call, statusOf } from "./call.js";
import { linkRow, nearby } from "./links.js";

const CONTROL_HZ = 50;

/** Maximum time that an episode may wait for an absent person. */
const PATIENCE_S = 600;

/** @typedef {import("../home/tasks.js").Task} Task */
/**
 * An episode that has begun.
 * @typedef {{
 *   episode_id: string, operators: { robot: string, token: string }[],
 *   instructions: { robot: string, instruction: string }[],
 * }} Started
 */
/**
 * A moment of a finished episode.
 * @typedef {{ run: string, at: number, task: string, seed: string, protocol: string }} Moment
 */

/**
 * Makes a field with its name before and its meaning below.
 * @param {string} text
 * @param {HTMLElement} field
 * @param {HTMLElement | null} [help]
 */
const labelled = (text, field, help = null) => element("p", {}, element("label", {}, element("span", {}, text), field), help);

/**
 * Lists the possible drivers of a robot. `policy` is the learned policy of the server, if it has one.
 * @param {string | null} policy
 */
const playersWith = (policy) => [
  ["person", "a person"], ["expert", "the task's expert, a script that sees everything"],
  ...(policy ? [["policy", `the learned policy ${policy}`]] : []),
  ["program", "a program or an agent of yours"], ["still", "nobody: it stands still"],
];

/**
 * Shows the form: of a new episode, of the task `wanted` if one was chosen, or of one that continues from a moment of a finished one.
 * @param {HTMLElement} main
 * @param {Moment | null} [from]
 * @param {string | null} [wanted]
 */
export function start(main, from = null, wanted = null) {
  const task = element("select", { name: "task", required: true });
  const seed = element("input", { name: "seed", type: "number", min: 0, max: 4294967295, step: 1, value: 0, required: true });
  const protocol = element("select", { name: "protocol" });
  const token = element("input", { name: "token", type: "password", autocomplete: "off" });
  const locked = labelled("The server's token", token);
  locked.hidden = true;
  const what = element("span", { class: "soft" });
  const players = element("div");
  /** @type {string | null} */
  let policy = null;
  const refusal = element("p", { class: "bad", role: "alert" });
  const links = element("div");
  /** @type {Task[]} */
  let tasks = [];

  const offer = () => {
    const chosen = tasks.find(({ id }) => id === task.value);
    const kept = protocol.value || from?.protocol;
    what.textContent = chosen?.instruction ?? "";
    protocol.replaceChildren(...(chosen?.protocols ?? []).map((rules) => element("option", { value: rules.protocol, selected: rules.protocol === kept }, toldRules(rules))));
    const robots = "ABC".slice(0, robotCount(chosen));
    players.replaceChildren(...[...robots].map((robot) => labelled(`Robot ${robot} is driven by`,
      element("select", { name: robot }, ...playersWith(policy).map(([value, told]) => element("option", { value }, told))))));
  };
  const load = async () => {
    refusal.textContent = "";
    try {
      ({ tasks } = await call("/v1/tasks", token.value));
      ({ policy } = await call("/operate/policy", token.value));
    } catch (error) {
      const wantsToken = statusOf(error) === 401;
      if (wantsToken) locked.hidden = false;
      refusal.textContent = wantsToken ? "This server wants its token." : reasonOf(error);
      return;
    }
    const offered = from ? tasks.filter(({ id }) => id === from.task) : tasks;
    task.replaceChildren(...offered.map(({ id, instruction }) => element("option", { value: id, title: instruction, selected: id === wanted }, id)));
    offer();
  };
  task.addEventListener("change", offer);
  token.addEventListener("change", load);

  const press = element("button", { class: "large primary" }, "Start");
  const begin = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    refusal.textContent = "";
    const chosen = new FormData(form);
    if (!["A", "B", "C"].some((robot) => chosen.get(robot) === "person")) {
      refusal.textContent = "Somebody has to drive a robot: choose a person for one of them. (The command tandem demo has experts play by themselves.)";
      return;
    }
    // A second press would begin a second episode.
    press.disabled = true;
    say(press, "Starting");
    const body = { task: task.value, seed: Number(seed.value), protocol: protocol.value, short: true, operators: "per_robot", patience_s: PATIENCE_S, talk: true };
    try {
      const started = from
        ? await call("/watch/take_over", token.value, { run: from.run, time_s: from.at, protocol: protocol.value }, { credentials: "same-origin" })
        : await call("/v1/episodes", token.value, body);
      links.replaceChildren(...await linksOf(started, chosen, token.value));
      links.scrollIntoView({ block: "nearest" });
    } catch (error) {
      refusal.textContent = reasonOf(error);
    }
    press.disabled = false;
    say(press, "Start");
  };
  const place = from
    ? element("p", {}, `Goes on where ${from.run} stood at ${from.at.toFixed(1)} s: ${words(from.task)}, seed ${from.seed}. It becomes an episode of its own, with a whole budget ahead.`)
    : null;
  const form = element("form", { onsubmit: begin, class: "operate-form" }, place ?? labelled("Task", task, what),
    from ? "" : labelled("Seed", seed, element("span", { class: "soft" }, "Says where things stand at the start: the same number, the same start.")),
    labelled("Rules", protocol, element("span", { class: "soft" }, "The budget: seconds that pass in the world, and the minutes that you may take for them.")), players, locked, press, refusal);
  main.replaceChildren(
    element("p", {}, element("a", { href: "/" }, "Start page")),
    element("h1", {}, from ? "Take over" : "Operate robots together"),
    element("p", {}, "Each person drives one robot, on a page of their own. Time passes while everybody's page is open and in view, and stands still while one is away. If you are alone, let the expert drive the others."),
    form,
    links);
  load();
}

/** Returns the text about a protocol's limits for a team. @param {import("../home/tasks.js").Rules} rules */
function toldRules({ protocol, episode_steps: steps, wall_clock_s: clockS }) {
  return `${protocol}: ${(steps / CONTROL_HZ).toFixed(0)} s${clockS ? ` within ${(clockS / 60).toFixed(0)} minutes` : ""}`;
}

const robotCount = (/** @type {Task | undefined} */ task) => task?.robots?.length ?? 2;

/**
 * Makes the links of an episode that has begun, and the data for programs. The driver of the first robot also keeps robots without a
 * driver standing still.
 * @param {Started} started the server's answer
 * @param {FormData} chosen
 * @param {string} hostToken
 */
async function linksOf({ episode_id: episode, operators, instructions }, chosen, hostToken) {
  const by = (/** @type {string} */ player) => operators.filter(({ robot }) => chosen.get(robot) === player);
  const [people, still] = [by("person"), by("still")];
  for (const player of ["expert", "policy"]) await Promise.all(by(player).map(({ robot }) => call(`/operate/${player}`, hostToken, { episode, robot })));
  const part = (/** @type {string} */ robot) => instructions.find((entry) => entry.robot === robot)?.instruction ?? "";
  const rows = people.map(({ robot, token }, index) => {
    const seat = new URLSearchParams({ episode, robot, token });
    if (index === 0 && still.length > 0) seat.set("still", still.map(({ robot: name, token: own }) => `${name}.${own}`).join(","));
    return linkRow(`Drive robot ${robot}`, `${location.origin}/operate#${seat}`, hostToken, part(robot));
  });
  return [element("h2", {}, "Links"),
    element("p", {}, "Open your own here, and send each other person one of these, and nobody else: who has the link drives the robot. They are shown this once."),
    nearby(),
    element("ul", { class: "links" }, ...await Promise.all(rows)),
    ...by("program").flatMap(({ robot, token }) => [
      element("h2", {}, `Robot ${robot}'s program`),
      element("p", {}, "Start it with this in its environment, or give an agent the address and the token. It commands by HTTP or MCP as ever; time stands still while it thinks."),
      element("pre", {}, [`TANDEM_URL=${location.origin}`, `TANDEM_EPISODE=${episode}`, `TANDEM_ROBOT=${robot}`, `TANDEM_TOKEN=${token}`].join("\n")),
    ]),
    ...by("expert").map(({ robot }) => element("p", {}, `The expert drives robot ${robot} as soon as somebody else commands.`)),
    ...by("policy").map(({ robot }) => element("p", {}, `The learned policy is connected, and drives robot ${robot} as soon as somebody else commands.`))];
}
