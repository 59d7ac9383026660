// The tasks with their pictures, and the start of an episode.

import { bearer, call } from "../operators/call.js";
import { element, reasonOf, say, words } from "../src/dom.js";

const CONTROL_HZ = 50;

/** @typedef {{ protocol: string, episode_steps: number, wall_clock_s?: number | null }} Rules */
/**
 * A task in the server's list.
 * @typedef {{
 *   id: string, suite: string, instruction: string, robots: string[], phases: unknown[], protocols: Rules[],
 * }} Task
 */

/** The section of tasks. */
export class Tasks {
  /**
   * @param {{ value: string }} token the server's token, from its field
   * @param {(started: { episode: string, task: string, seed: number }) => void} onStart called with an episode
   *   that was started
   */
  constructor(token, onStart) {
    this.token = token;
    this.onStart = onStart;
    this.seed = element("input", {
      type: "number",
      name: "seed",
      min: 0,
      max: 4294967295,
      step: 1,
      value: 0,
      required: true,
    });
    this.protocol = element(
      "select",
      { name: "protocol" },
      element("option", {}, "agentic"),
      element("option", {}, "benchmark"),
    );
    this.grid = element("div", { class: "cards" });
    this.node = element(
      "section",
      { id: "tasks", "aria-labelledby": "tasks-title", hidden: true },
      element("h2", { id: "tasks-title" }, "Tasks"),
      element(
        "p",
        { class: "soft" },
        "Start an episode for an agent or a program, or drive the robots yourself. Equal seeds give equal starts.",
      ),
      element(
        "form",
        { class: "filters", "aria-label": "Start of an episode", onsubmit: (event) => event.preventDefault() },
        element("label", {}, element("span", {}, "Seed"), this.seed),
        element("label", {}, element("span", {}, "Rules"), this.protocol),
      ),
      this.grid,
    );
  }

  /**
   * Shows the list of tasks, and requests their pictures. The first task's picture is also shown in `front`.
   * @param {Task[]} tasks
   * @param {HTMLImageElement} front
   */
  take(tasks, front) {
    this.node.hidden = false;
    if (tasks.length) this.draw(front, tasks[0].id);
    const cards = tasks.map((task) => this.card(task));
    this.grid.replaceChildren(...cards.map(({ node }) => node));
    // A picture is rendered at its first request, so those at the top are requested first.
    const seen = new IntersectionObserver(
      (changes) => {
        for (const { isIntersecting, target } of changes) {
          if (!isIntersecting) continue;
          seen.unobserve(target);
          cards.find(({ node }) => node === target)?.draw();
        }
      },
      { rootMargin: "300px" },
    );
    for (const { node } of cards) seen.observe(node);
  }

  /** @param {Task} task */
  card(task) {
    const { id, suite, instruction, robots, phases, protocols } = task;
    const picture = element("img", { alt: "" });
    const told = element("p", { class: "bad", role: "alert" });
    const done = element("p", { role: "status" });
    const start = element(
      "button",
      {
        type: "button",
        class: "primary",
        "aria-label": `Start ${words(id)}`,
        onclick: () => {
          this.start(task, start, told, done);
        },
      },
      "Start",
    );
    const longest = Math.max(...protocols.map(({ episode_steps: steps }) => steps)) / CONTROL_HZ;
    const facts = [
      `${robots.length} robots`,
      phases.length ? `${phases.length} phases` : null,
      `up to ${longest.toFixed(0)} s`,
      suite,
    ].filter(Boolean);
    const node = element(
      "article",
      { class: "card task" },
      element("div", { class: "picture" }, picture),
      element("h3", { class: "name" }, words(id)),
      element("div", { class: "soft" }, facts.join(" · ")),
      element("p", { class: "goal" }, instruction),
      element(
        "div",
        { class: "tools" },
        start,
        element(
          "a",
          {
            class: "action",
            href: `/operate?task=${encodeURIComponent(id)}`,
            "aria-label": `Drive ${words(id)}`,
          },
          "Drive",
        ),
      ),
      told,
      done,
    );
    return { node, draw: () => this.draw(picture, id) };
  }

  /** Shows the picture of a task. @param {HTMLImageElement} picture @param {string} id */
  async draw(picture, id) {
    const headers = bearer(this.token.value);
    const answer = await fetch(`/home/picture?task=${encodeURIComponent(id)}`, { headers });
    if (!answer.ok) return;
    picture.src = URL.createObjectURL(await answer.blob());
    await picture.decode().catch(() => null);
    URL.revokeObjectURL(picture.src);
  }

  /**
   * Starts an episode.
   * @param {Task} task
   * @param {HTMLButtonElement} press
   * @param {HTMLElement} told
   * @param {HTMLElement} done
   */
  async start({ id }, press, told, done) {
    if (!this.seed.reportValidity()) return;
    const seed = Number(this.seed.value);
    say(told, "");
    // A second press would begin a second episode.
    press.disabled = true;
    try {
      const { episode_id: episode } = await call("/v1/episodes", this.token.value, {
        task: id,
        seed,
        protocol: this.protocol.value,
        short: true,
      });
      done.replaceChildren(
        element("strong", {}, episode),
        " waits for its first command. ",
        element("a", { href: `/watch?episode=${encodeURIComponent(episode)}` }, "Watch it"),
        " or ",
        element("a", { href: "#connect" }, "connect an agent"),
        ".",
      );
      this.onStart({ episode, task: id, seed });
    } catch (error) {
      say(told, reasonOf(error));
    }
    press.disabled = false;
  }
}
