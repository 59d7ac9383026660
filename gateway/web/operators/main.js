// `/operate`: a visitor with the link of a robot drives it, once or in all episodes of a collection. A visitor without a link starts
// an episode.

import { collect, overview } from "./collect.js";
import { drive } from "./drive.js";
import { start } from "./start.js";

const KEPT = "tandem-operator";

/**
 * Place of a person: a robot of an episode or of a collection, or a collection for its host. `still` contains the robots without
 * a driver, with their tokens.
 * @typedef {{ token: string, robot: string, episode?: string, still?: string, collection?: string }} Seat
 */

/**
 * Returns the contents of the link: from the fragment, which browsers do not send, or else from this tab, so that a
 * page may be reloaded.
 * @returns {Seat | null}
 */
function seat() {
  const given = new URLSearchParams(location.hash.slice(1));
  if (given.has("token")) {
    sessionStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(given)));
    history.replaceState(null, "", "/operate?robot");
  }
  if (!location.search) return null;
  return JSON.parse(sessionStorage.getItem(KEPT) ?? "null");
}

/** Shows the page for this visitor. @param {HTMLElement} main */
export function operate(main) {
  // A second link pasted into the same tab changes only the fragment.
  addEventListener("hashchange", () => location.hash.includes("token=") && (seat(), location.reload()));
  const asked = new URLSearchParams(location.search);
  const run = asked.get("run");
  if (run) return start(main, { run, at: Number(asked.get("at")), task: asked.get("task") ?? "", seed: asked.get("seed") ?? "", protocol: asked.get("protocol") ?? "" });
  if (asked.has("task")) return start(main, null, asked.get("task"));
  const held = seat();
  if (!held) return start(main);
  if (held.collection) return held.robot ? collect(main, held) : overview(main, held);
  return drive(main, { ...held, episode: held.episode ?? "" });
}
