// The first page: a card for every episode that runs or has ended.

import { ask, element, endOf, words } from "./dom.js";

const EVERY_MS = 1500;
/** How wide a strip's cells are. */
const CELL_PIXELS = 400;

export function cards(main) {
  document.title = "Tandem: episodes";
  const running = element("div", { class: "cards" });
  const evaluations = element("div", { class: "cards" });
  const evaluated = element("section", { hidden: true }, element("h2", {}, "Evaluations"), evaluations);
  const finished = element("div", { class: "cards" });
  const none = element("p", { class: "soft" });
  const problem = element("p", { class: "bad", role: "alert" });
  const version = element("span", { class: "soft" });
  main.replaceChildren(
    element("header", { class: "top" }, element("h1", {}, "Tandem"), version, element("a", { href: "/operate" }, "Drive robots yourself")),
    problem,
    element("h2", {}, "Running"), none, running,
    evaluated,
    element("h2", {}, "Finished"), finished,
  );
  let shown = "";
  const look = async () => {
    try {
      const list = await (await ask("/watch/episodes")).json();
      problem.textContent = "";
      version.textContent = list.version;
      const text = JSON.stringify(list);
      if (text === shown) return;
      shown = text;
      // One that has ended is looked at as its folder has it, once that is written.
      const finishedRuns = new Set(list.finished.map(({ run }) => run));
      const held = list.held.filter((entry) => !finishedRuns.has(entry.episode_id));
      none.textContent = held.length ? "" : "None runs. An episode appears here by itself once a policy or a person starts it, and so does an evaluation that is written into this server's folder of runs.";
      running.replaceChildren(...held.map(heldCard));
      evaluated.hidden = !list.evaluations.length;
      evaluations.replaceChildren(...list.evaluations.map(evaluationCard));
      finished.replaceChildren(...list.finished.map(finishedCard));
      if (!list.finished.length) finished.append(element("p", { class: "soft" }, "None yet. ", element("code", {}, "tandem demo"), ", run where this server was started, plays one within seconds."));
    } catch (error) {
      problem.textContent = `Not up to date: ${error.message}`;
    }
  };
  look();
  setInterval(() => document.hidden || look(), EVERY_MS);
}

function heldCard(entry) {
  const stands = entry.ended ? words(entry.ended) : "runs";
  return element("a", { class: "card", href: `/watch?episode=${encodeURIComponent(entry.episode_id)}` },
    element("div", { class: "line" }, element("strong", {}, words(entry.task)), badge(stands, entry.ended ? "" : "live")),
    element("div", { class: "soft" }, `seed ${entry.seed}, ${entry.protocol}, ${entry.operators === "per_robot" ? "an operator for each robot" : "one policy for all robots"}`),
    element("div", {}, `${(entry.step / 50).toFixed(1)} s, step ${entry.step}`),
    element("div", { class: "soft id" }, entry.episode_id));
}

/** How far an evaluation is, which another process plays. */
function evaluationCard({ folder, policies, tasks, played, succeeded, excluded, planned, last_unix_s: lastS, runs }) {
  const stands = runs ? badge("runs", "live") : badge(played < (planned ?? 0) ? "stopped" : "complete", "");
  const left = [`${succeeded} of ${played - excluded} succeeded`, excluded ? `${excluded} do not count` : null].filter(Boolean).join(", ");
  return element("div", { class: "card" },
    element("div", { class: "line" }, element("strong", {}, policies.join(", ") || "nothing yet"), stands),
    element("div", { class: "soft" }, tasks.length > 3 ? `${tasks.length} tasks` : tasks.map(words).join(", ")),
    planned ? element("progress", { value: played, max: planned, "aria-label": "Episodes played" }) : null,
    element("div", {}, `${played}${planned ? ` of ${planned}` : ""} episodes, ${left}`),
    element("div", { class: "soft id" }, `${folder}, ${new Date(1000 * lastS).toLocaleString()}`));
}

function finishedCard({ run, result, ended_unix_s: endedS, recorded, strip }) {
  const phases = Object.entries(result.phases ?? {});
  const reached = phases.filter(([, time]) => time !== null).length;
  const done = phases.length > 0 && reached === phases.length;
  const inside = [
    strip ? element("div", { class: "strip" }, lastMoment(`/watch/file?run=${encodeURIComponent(run)}&file=strip.png`)) : null,
    element("div", { class: "line" }, element("strong", {}, words(result.task)), badge(`${reached} of ${phases.length} phases`, done ? "good" : "bad")),
    element("div", { class: "soft" }, `seed ${result.seed}, ${result.protocol}, ${endOf(result)}`),
    element("div", {}, `${(result.env_steps / 50).toFixed(1)} s, ${result.tool_calls} calls, ${result.falls} falls`),
    element("div", { class: "soft id" }, `${run}, ${new Date(1000 * endedS).toLocaleString()}`),
  ];
  // A failed episode opens where it failed, which is its end.
  const at = done ? "" : `&at=${(result.env_steps / 50).toFixed(1)}`;
  return recorded
    ? element("a", { class: "card", href: `/watch?run=${encodeURIComponent(run)}${at}` }, ...inside)
    : element("div", { class: "card" }, ...inside, element("div", { class: "soft" }, "Not recorded."));
}

/** A strip, as wide that a cell of it fills its card. */
function lastMoment(src) {
  const image = element("img", { src, alt: "", loading: "lazy", onload: () => { image.style.width = `${(100 * image.naturalWidth) / CELL_PIXELS}cqw`; } });
  return image;
}

export const badge = (text, kind) => element("span", { class: `badge ${kind}` }, text);
