// The choice among finished episodes: by task, policy, result, age and text. The page's address contains it, so
// that it can be shared.

/**
 * A finished episode in the server's list.
 * @typedef {{
 *   run: string, policy?: string | null, ended_unix_s: number, recorded?: boolean, strip?: boolean,
 *   result: import("../src/message.js").Result,
 * }} FinishedEpisode
 */
/**
 * A value for each of `NAMES`; an empty value matches every episode.
 * @typedef {Record<string, string>} Choice
 */

/** @type {[string, string][]} */
export const RESULTS = [
  ["success", "all phases"],
  ["some", "some phases"],
  ["none", "no phase"],
];
/** Ages up to which episodes are shown, in seconds. @type {[string, string, number][]} */
export const AGES = [
  ["hour", "the last hour", 3600],
  ["day", "the last day", 86_400],
  ["week", "the last week", 604_800],
  ["month", "the last month", 2_592_000],
];
export const NAMES = ["text", "task", "policy", "result", "age"];

/**
 * Returns an episode's policy for a list, or the text for an unknown policy.
 * @param {FinishedEpisode} episode
 */
export const policyOf = ({ policy }) => policy ?? "not named";

/** Returns the number of phases, and of those that were reached. @param {FinishedEpisode} episode */
export function phasesOf({ result }) {
  const times = Object.values(result.phases ?? {});
  return { all: times.length, reached: times.filter((time) => time !== null).length };
}

/** @param {FinishedEpisode} entry */
function resultOf(entry) {
  const { all, reached } = phasesOf(entry);
  if (reached === 0) return "none";
  return reached === all ? "success" : "some";
}

/** Reads a choice from the query of an address. @param {string} query @returns {Choice} */
export function chosenIn(query) {
  const given = new URLSearchParams(query);
  return Object.fromEntries(NAMES.map((name) => [name, given.get(name) ?? ""]));
}

/**
 * Returns the query of an address with a choice. Other parameters are kept.
 * @param {string} query
 * @param {Choice} choice
 */
export function withChoice(query, choice) {
  const params = new URLSearchParams(query);
  for (const name of NAMES) {
    if (choice[name]) params.set(name, choice[name]);
    else params.delete(name);
  }
  const text = params.toString();
  return text ? `?${text}` : "";
}

/**
 * Returns the entries that match a choice. Every word of its text has to occur on the card.
 * @param {FinishedEpisode[]} entries
 * @param {Choice} choice
 * @param {number} nowS
 */
export function filtered(entries, choice, nowS) {
  const words = choice.text.toLowerCase().split(/\s+/).filter(Boolean);
  const age = AGES.find(([name]) => name === choice.age)?.[2] ?? Infinity;
  return entries.filter((entry) => {
    const { task, seed, protocol, ended } = entry.result;
    const said = [task, task.replaceAll("_", " "), "seed", seed, protocol, ended, policyOf(entry), entry.run]
      .join(" ")
      .toLowerCase();
    return (
      (!choice.task || task === choice.task) &&
      (!choice.policy || policyOf(entry) === choice.policy) &&
      (!choice.result || resultOf(entry) === choice.result) &&
      nowS - entry.ended_unix_s <= age &&
      words.every((word) => said.includes(word))
    );
  });
}

/**
 * Returns the values of a property with their numbers of episodes, by name.
 * @param {FinishedEpisode[]} entries
 * @param {(entry: FinishedEpisode) => string} valueOf
 */
export function counted(entries, valueOf) {
  /** @type {Map<string, number>} */
  const counts = new Map();
  for (const entry of entries) counts.set(valueOf(entry), (counts.get(valueOf(entry)) ?? 0) + 1);
  return [...counts].sort(([one], [other]) => (one < other ? -1 : 1));
}
