// Episodes that the server holds, with live pictures for those with the watch link, and evaluations.

import { badge, element, say, words } from "../src/dom.js";

const CONTROL_HZ = 50;
/** Interval between two pictures of an episode that runs. */
const PICTURE_MS = 2000;

/**
 * An episode that the server holds.
 * @typedef {{
 *   episode_id: string, task: string, seed: number | null, protocol: string, operators: string,
 *   step: number, ended?: string | null,
 * }} HeldEpisode
 */
/**
 * An evaluation that another process plays.
 * @typedef {{
 *   folder: string, policies: string[], tasks: string[], played: number, succeeded: number, excluded: number,
 *   planned: number | null, last_unix_s: number, runs: boolean,
 * }} Evaluation
 */

/** The sections of held episodes and of evaluations. */
export class Running {
  constructor() {
    /** @type {Map<string, HeldCard>} */
    this.cards = new Map();
    this.none = element("p", { class: "soft" });
    this.grid = element("div", { class: "cards" });
    this.evaluations = element("div", { class: "cards" });
    this.evaluated = element(
      "section",
      { hidden: true, "aria-labelledby": "evaluations-title" },
      element("h2", { id: "evaluations-title" }, "Evaluations"),
      this.evaluations,
    );
    this.node = element(
      "section",
      { id: "running", "aria-labelledby": "running-title" },
      element("h2", { id: "running-title" }, "Running"),
      this.none,
      this.grid,
    );
    this.draw();
  }

  /**
   * Shows a new list. `asleep` contains the suspended episodes; it is null without the watch link.
   * @param {HeldEpisode[]} held
   * @param {Evaluation[]} evaluations
   * @param {Set<string> | null} asleep
   */
  take(held, evaluations, asleep) {
    say(
      this.none,
      held.length ? "" : "None runs. An episode appears here by itself once a policy or a person starts it.",
    );
    /** @type {Map<string, HeldCard>} */
    const cards = new Map();
    for (const entry of held) {
      const card = this.cards.get(entry.episode_id) ?? new HeldCard(entry);
      card.take(entry, asleep);
      cards.set(entry.episode_id, card);
    }
    if ([...cards.keys()].join() !== [...this.cards.keys()].join())
      this.grid.replaceChildren(...[...cards.values()].map(({ node }) => node));
    this.cards = cards;
    this.evaluated.hidden = !evaluations.length;
    this.evaluations.replaceChildren(...evaluations.map(evaluationCard));
  }

  /** Draws one picture after another, so that a page with many episodes requests only one at a time. */
  async draw() {
    for (const card of document.hidden ? [] : this.cards.values()) await card.draw();
    setTimeout(() => this.draw(), PICTURE_MS);
  }
}

class HeldCard {
  /** @param {HeldEpisode} episode */
  constructor({ episode_id: id, task, seed, protocol, operators }) {
    this.source = `/watch/camera?episode=${encodeURIComponent(id)}&robot=third_person`;
    /** Steps of the newest picture and of the shown one. @type {number | null} */
    this.wanted = null;
    /** @type {number | null} */
    this.drawn = null;
    this.state = badge("", "");
    this.time = element("div");
    this.picture = element("img", { alt: "" });
    this.frame = element("div", { class: "picture", hidden: true }, this.picture);
    this.node = element(
      "article",
      { class: "card" },
      this.frame,
      element(
        "div",
        { class: "line" },
        element(
          "h3",
          { class: "name" },
          element("a", { href: `/watch?episode=${encodeURIComponent(id)}` }, words(task)),
        ),
        this.state,
      ),
      element(
        "div",
        { class: "soft" },
        [
          seed === null ? null : `seed ${seed}`,
          protocol,
          operators === "per_robot" ? "an operator per robot" : "one policy",
        ]
          .filter(Boolean)
          .join(", "),
      ),
      this.time,
      element("div", { class: "soft id" }, id),
    );
  }

  /** @param {HeldEpisode} episode @param {Set<string> | null} asleep */
  take({ episode_id: id, step, ended }, asleep) {
    const sleeps = asleep?.has(id);
    say(this.state, ended ? words(ended) : sleeps ? "put aside" : "runs");
    this.state.className = `badge ${ended || sleeps ? "" : "live"}`;
    say(this.time, `${(step / CONTROL_HZ).toFixed(1)} s, step ${step}`);
    // A picture would wake a suspended episode.
    this.wanted = asleep && !sleeps ? step : null;
  }

  /** Requests the picture of the newest step, unless it is already shown. */
  async draw() {
    if (this.wanted === null || this.wanted === this.drawn) return;
    this.drawn = this.wanted;
    this.picture.src = `${this.source}&step=${this.drawn}`;
    this.frame.hidden = !(await this.picture.decode().then(
      () => true,
      () => false,
    ));
  }
}

/** Makes the card of an evaluation. @param {Evaluation} evaluation */
function evaluationCard({
  folder,
  policies,
  tasks,
  played,
  succeeded,
  excluded,
  planned,
  last_unix_s: lastS,
  runs,
}) {
  const stands = runs ? badge("runs", "live") : badge(played < (planned ?? 0) ? "stopped" : "complete", "");
  const left = [`${succeeded} of ${played - excluded} succeeded`, excluded ? `${excluded} do not count` : null]
    .filter(Boolean)
    .join(", ");
  return element(
    "article",
    { class: "card" },
    element("div", { class: "line" }, element("h3", {}, policies.join(", ") || "nothing yet"), stands),
    element("div", { class: "soft" }, tasks.length > 3 ? `${tasks.length} tasks` : tasks.map(words).join(", ")),
    planned ? element("progress", { value: played, max: planned, "aria-label": "Episodes played" }) : null,
    element("div", {}, `${played}${planned ? ` of ${planned}` : ""} episodes, ${left}`),
    element("div", { class: "soft id" }, `${folder}, ${new Date(1000 * lastS).toLocaleString()}`),
  );
}
