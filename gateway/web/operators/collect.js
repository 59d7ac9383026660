// Episodes that the same people play one after another: each person has one link for all episodes. Between two episodes the page
// announces the next one, and asks whether the last one was good.

import { element, reasonOf, words } from "../src/dom.js";
import { Refused, call } from "./call.js";
import { drive } from "./drive.js";
import { linkRow, nearby } from "./links.js";

const POLL_MS = 700;
const sleep = (/** @type {number} */ ms) => new Promise((done) => setTimeout(done, ms));

/** @typedef {import("./main.js").Seat} Seat */
/**
 * Progress of a collection.
 * @typedef {{
 *   stage: "preparing" | "playing" | "marking" | "over", planned: number, good: number, bad: number, robots: string[],
 *   marks: (boolean | null)[], operators: { robot: string, token: string }[],
 *   episode: { episode_id: string, number: number, task: string, seed: number } | null,
 * }} Progress
 */

/**
 * Lets the person of `seat` drive, mark and wait until all episodes are complete.
 * @param {HTMLElement} main
 * @param {Seat} seat
 */
export async function collect(main, seat) {
  /** @type {Awaited<ReturnType<typeof drive>>} */
  let ended = null;
  for (let driven = ""; ;) {
    const progress = await ask(main, seat);
    const { stage, episode } = progress;
    if (stage === "over") return show(main, progress, element("p", {}, "That was the last one. Thank you."));
    if (stage === "playing" && episode && driven !== episode.episode_id + episode.number) {
      await invited(main, progress, episode.episode_id, seat);
      ended = await drive(main, { ...seat, episode: episode.episode_id });
      ended?.leave();
      driven = episode.episode_id + episode.number;
    } else if (stage === "marking" && progress.marks[progress.robots.indexOf(seat.robot)] === null) {
      await marked(main, progress, seat, ended?.result);
    } else {
      show(main, progress, element("p", { role: "status" }, stage === "marking" ? `Waiting for ${missing(progress)} to mark it.` : "The next episode is made ready."));
      await sleep(POLL_MS);
    }
  }
}

/**
 * Requests the progress of the collection, repeatedly while the server cannot be reached.
 * @param {HTMLElement} main
 * @param {Seat} seat
 * @returns {Promise<Progress>}
 */
async function ask(main, seat) {
  for (;;) {
    try {
      return await call("/operate/collection", seat.token);
    } catch (error) {
      main.replaceChildren(element("h1", {}, "Nothing to drive"), element("p", { class: "bad", role: "alert" }, error instanceof Refused ? error.message : "The collection has ended, or its server cannot be reached. This page tries again."));
      await sleep(5 * POLL_MS);
    }
  }
}

const missing = (/** @type {Progress} */ { robots, marks }) => robots.filter((_, seat) => marks[seat] === null).join(" and ");

/** @param {HTMLElement} main @param {Progress} progress @param {...(HTMLElement | null)} below */
function show(main, { episode, planned, good, bad }, ...below) {
  const title = episode ? `Episode ${episode.number} of ${planned}: ${words(episode.task)}, seed ${episode.seed}` : `${planned} episodes`;
  const counts = good + bad > 0 ? element("p", { class: "soft" }, `Good so far: ${good}; bad: ${bad}.`) : null;
  main.replaceChildren(element("h1", {}, title), ...[counts, ...below].filter((part) => part !== null));
}

/**
 * Shows a person's instruction, and waits until the person begins. The clock starts when everybody has begun.
 * @param {HTMLElement} main
 * @param {Progress} progress
 * @param {string} episode
 * @param {Seat} seat
 */
async function invited(main, progress, episode, { robot, token }) {
  /** @type {import("./panel.js").Briefing | null} */
  const briefing = await call(`/v1/episodes/${encodeURIComponent(episode)}/briefing`, token).catch(() => null);
  const part = briefing?.instructions.find((entry) => entry.robot === robot)?.instruction;
  await new Promise((done) => {
    const begin = element("button", { type: "button", class: "large primary", onclick: done }, "Begin");
    show(main, progress, element("p", {}, `You drive robot ${robot}. ${part ?? ""}`),
      element("p", { class: "soft" }, "Time passes once everybody has begun. The episode ends when the task is done or its time is over, or when everybody has pressed Finish."), begin);
    begin.focus();
  });
}

/** Returns the outcome of an episode in a sentence. @param {import("./wheel.js").Ended} result */
function outcome({ ended, phases }) {
  const times = Object.values(phases ?? {});
  const counted = times.length ? `, with ${times.filter((time) => time !== null).length} of ${times.length} phases reached` : "";
  return `It has ended: ${words(ended)}${counted}.`;
}

/**
 * Asks one person whether the episode was good.
 * @param {HTMLElement} main
 * @param {Progress} progress
 * @param {Seat} seat
 * @param {import("./wheel.js").Ended | undefined} result
 */
const marked = (main, progress, seat, result) => new Promise((done) => {
  const refusal = element("p", { class: "bad", role: "alert" });
  const say = (/** @type {boolean} */ good) => call("/operate/mark", seat.token, { good }).then(done, (error) => { refusal.textContent = reasonOf(error); });
  show(main, progress, result ? element("p", {}, outcome(result)) : null,
    element("p", {}, "Was it good? It is kept as a demonstration if everybody says so. Otherwise it is put aside, and played again when the collection is run again."),
    element("div", { class: "tools" },
      element("button", { type: "button", class: "large", onclick: () => say(true) }, "Good"),
      element("button", { type: "button", class: "large", onclick: () => say(false) }, "Bad")), refusal);
});

/**
 * Shows the page of the host of the collection: a link for each person, and the progress.
 * @param {HTMLElement} main
 * @param {Seat} seat
 */
export async function overview(main, seat) {
  const links = element("ul", { class: "links" });
  const progress = await ask(main, seat);
  for (const { robot, token } of progress.operators) {
    const given = new URLSearchParams({ collection: "1", robot, token });
    links.append(await linkRow(`Drive robot ${robot}`, `${location.origin}/operate#${given}`, seat.token));
  }
  const at = element("p", { role: "status" });
  for (let now = progress; ; now = await ask(main, seat)) {
    show(main, now, at, element("h2", {}, "Links"), element("p", {}, "Send each person one of these, and nobody else: who has the link drives the robot, in all episodes."), nearby(), links);
    at.textContent = { preparing: "The next episode is made ready.", playing: "It is played, once everybody has begun.", marking: `Waiting for ${missing(now)} to mark it.`, over: "All episodes are there." }[now.stage];
    if (now.stage === "over") return;
    await sleep(POLL_MS);
  }
}
