// The lists of episodes, kept up to date.

import { Refused, call, statusOf } from "../operators/call.js";
import { element, reasonOf, say } from "../src/dom.js";

const EVERY_MS = 1500;
/** @type {RequestInit} */
const WITH_COOKIE = { credentials: "same-origin" };

/**
 * Lists of episodes and evaluations.
 * @typedef {{
 *   version?: string, held: import("./running.js").HeldEpisode[], asleep: string[],
 *   evaluations: import("./running.js").Evaluation[], finished: import("./filters.js").FinishedEpisode[],
 * }} Lists
 */

/** The lists, in full for those with the watch link; for others the episodes that their token shows. */
export class Feed {
  /**
   * @param {import("./running.js").Running} running
   * @param {import("./finished.js").Finished} finished
   * @param {{ value: string }} token the server's token, from its field
   */
  constructor(running, finished, token) {
    this.running = running;
    this.finished = finished;
    this.token = token;
    this.watches = true;
    this.lost = false;
    this.shown = "";
    this.problem = element("p", { class: "bad", role: "alert" });
    this.version = element("span", { class: "soft" });
    this.door = this.makeDoor();
  }

  start() {
    this.look();
    setInterval(() => document.hidden || this.look(), EVERY_MS);
  }

  async look() {
    try {
      const list = await this.list();
      if (this.lost) say(this.problem, "");
      this.lost = false;
      const text = JSON.stringify(list);
      if (text === this.shown) return;
      this.shown = text;
      say(this.version, list.version ?? "");
      // An ended episode is shown from its folder, once that is written.
      const finishedRuns = new Set(list.finished.map(({ run }) => run));
      this.running.take(
        list.held.filter((entry) => !finishedRuns.has(entry.episode_id)),
        list.evaluations,
        this.watches ? new Set(list.asleep) : null,
      );
      this.door.hidden = this.watches;
      this.finished.node.hidden = !this.watches;
      if (this.watches) this.finished.take(list.finished);
    } catch (error) {
      this.lost = true;
      say(this.problem, `Not up to date: ${reasonOf(error)}`);
    }
  }

  /** Asks for the lists. @returns {Promise<Lists>} */
  async list() {
    if (this.watches) {
      try {
        return await call("/watch/episodes", null, null, WITH_COOKIE);
      } catch (error) {
        if (!(error instanceof Refused) || location.pathname !== "/" || ![401, 403].includes(error.status))
          throw error;
        this.watches = false;
      }
    }
    const { episodes } = await call("/v1/episodes", this.token.value).catch((error) => {
      if (statusOf(error) === 401) return { episodes: [] };
      throw error;
    });
    return { held: episodes, asleep: [], evaluations: [], finished: [] };
  }

  /** Asks for the watch link, where the finished episodes would be. */
  makeDoor() {
    const field = element("input", { name: "link", autocomplete: "off", required: true });
    const told = element("p", { class: "bad", role: "alert" });
    const enter = async (/** @type {Event} */ event) => {
      event.preventDefault();
      const key = field.value.trim().split("#").pop();
      const answer = await fetch("/watch", { method: "POST", headers: { authorization: `Bearer ${key}` } });
      say(
        told,
        answer.ok
          ? ""
          : "That is not this server's link, or it is of an earlier start: each start prints a new one.",
      );
      this.watches = answer.ok;
      if (answer.ok) this.look();
    };
    return element(
      "section",
      { hidden: true, "aria-labelledby": "door-title" },
      element("h2", { id: "door-title" }, "Watch"),
      element(
        "p",
        { class: "soft" },
        "Live pictures and finished episodes need the link that the server printed when it started, ",
        "because they show where every object is, which no policy may know.",
      ),
      element(
        "form",
        { class: "ask", onsubmit: enter },
        element("label", {}, element("span", {}, "The watch link, or its last part after #"), field),
        element("button", { class: "primary" }, "Open"),
      ),
      told,
    );
  }
}
