// The card of a finished episode.

import { badge, element, endOf, words } from "../src/dom.js";
import { phasesOf } from "./filters.js";

/** Width of a strip's cells. */
const CELL_PIXELS = 400;
const CONTROL_HZ = 50;

/**
 * Makes the card of an episode, with `button` in its corner.
 * @param {import("./filters.js").FinishedEpisode} entry
 * @param {HTMLElement | null} button
 */
export function finishedCard(entry, button) {
  const { run, result, ended_unix_s: endedS, recorded, strip } = entry;
  const { all, reached } = phasesOf(entry);
  const done = all > 0 && reached === all;
  // A failed episode opens at its end, where it failed.
  const at = done ? "" : `&at=${(result.env_steps / CONTROL_HZ).toFixed(1)}`;
  const name = words(result.task);
  return element(
    "article",
    { class: "card" },
    strip
      ? element(
          "div",
          { class: "strip" },
          lastMoment(`/watch/file?run=${encodeURIComponent(run)}&file=strip.png`),
        )
      : null,
    element(
      "div",
      { class: "line" },
      element(
        "h3",
        { class: "name" },
        recorded ? element("a", { href: `/watch?run=${encodeURIComponent(run)}${at}` }, name) : name,
      ),
      badge(`${reached} of ${all} phases`, done ? "good" : "bad"),
    ),
    element(
      "div",
      { class: "soft" },
      [entry.policy, `seed ${result.seed}`, result.protocol, endOf(result)].filter(Boolean).join(", "),
    ),
    element(
      "div",
      {},
      `${(result.env_steps / CONTROL_HZ).toFixed(1)} s, ${result.tool_calls} calls, ${result.falls} falls`,
    ),
    element(
      "div",
      { class: "line foot" },
      element(
        "div",
        { class: "soft id" },
        `${run}, ${new Date(1000 * endedS).toLocaleString()}${recorded ? "" : ". Not recorded."}`,
      ),
      button,
    ),
  );
}

/** Makes the image of a strip, in the width at which one cell fills the card. @param {string} src */
function lastMoment(src) {
  const image = element("img", {
    src,
    alt: "",
    loading: "lazy",
    onload: () => {
      image.style.width = `${(100 * image.naturalWidth) / CELL_PIXELS}cqw`;
    },
  });
  return image;
}
