// Elements of a page. Texts are inserted as text, so text of a policy never becomes HTML.

/** @typedef {string | number | boolean | null | undefined} Attribute */
/** @typedef {Record<string, Attribute | ((event: any) => unknown)>} Properties */

/**
 * Makes an element. Properties whose names begin with "on" are listeners, others are attributes; false and null leave them out.
 * @template {keyof HTMLElementTagNameMap} Name
 * @param {Name} name
 * @param {Properties} [properties]
 * @param {...(Node | string | null | undefined)} children
 * @returns {HTMLElementTagNameMap[Name]}
 */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (typeof value === "function") made.addEventListener(key.slice(2), value);
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, value === true ? "" : String(value));
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** Sets the text of a node, unless it already has it. @param {Node} node @param {string} text */
export function say(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Returns a name with blanks instead of underscores. @param {string} name */
export const words = (name) => String(name).replaceAll("_", " ");

/**
 * Describes the end of an episode: the ending of a model's play if that is more specific, or else the episode's own.
 * @param {import("./message.js").Result} result
 */
export function endOf(result) {
  const own = (result.usage?.endings ?? []).filter(({ ending }) => ending !== "success" && ending !== "finished");
  return own.map(({ robot, ending }) => (robot ? `${robot}: ` : "") + words(ending)).join(", ") || words(result.ended);
}

/** Returns the colour that the style sheet calls `name`. @param {string} name */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Sends a request to the server, and returns its answer. Throws a refusal with the server's text. @param {string} path */
export async function ask(path) {
  const answer = await fetch(path);
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({}));
  throw new Error(problem.detail ?? `the server answers ${answer.status}`);
}

/** Requests an image on a surface of a watched scene. @param {string} hash */
export const watchedTexture = (hash) => ask(`/watch/texture?hash=${hash}`);

/** Describes the reason of a failure. @param {unknown} error */
export const reasonOf = (error) => (error instanceof Error ? error.message : String(error));

/** Makes a small label of a state; `kind` is its colour. @param {string} text @param {string} kind */
export const badge = (text, kind) => element("span", { class: `badge ${kind}` }, text);

/**
 * Makes a button that copies a text. Browsers let pages copy only if they came over HTTPS or from the same machine. Other pages get no button.
 * @param {() => string} text
 */
export function copying(text, label = "Copy") {
  if (!navigator.clipboard) return null;
  const copy = element("button", { type: "button", class: "small", onclick: () => {
    navigator.clipboard.writeText(text()).then(() => say(copy, "Copied"), () => say(copy, "Not copied: select the text"));
    setTimeout(() => say(copy, label), 2000);
  } }, label);
  return copy;
}

/** Returns the colour of a robot's accent. @param {number} robot */
export const robotColour = (robot) => colour(["--a", "--b", "--c"][robot % 3]);
