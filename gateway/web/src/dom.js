// Elements of a page. Texts are texts: nothing that comes from a policy becomes HTML.

/**
 * Makes an element. Properties that begin with "on" are listeners, others are attributes; false and null leave them out.
 * @param {string} name @param {Record<string, unknown>} [properties] @param {...(Node | string | null)} children
 */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== false && value !== null && value !== undefined) made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

/** Shows `text` where it is not shown yet. */
export function say(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export const words = (name) => String(name).replaceAll("_", " ");

/** How an episode ended: by the end of a model's play, where that says more, else by its own. */
export function endOf(result) {
  const own = (result.usage?.endings ?? []).filter(({ ending }) => ending !== "success" && ending !== "finished");
  return own.map(({ robot, ending }) => (robot ? `${robot}: ` : "") + words(ending)).join(", ") || words(result.ended);
}

/** The colour that the style sheet calls `name`. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** What a request is answered with; a refusal is thrown, in the server's words. */
export async function ask(path) {
  const answer = await fetch(path);
  if (answer.ok) return answer;
  const problem = await answer.json().catch(() => ({}));
  throw new Error(problem.detail ?? `the server answers ${answer.status}`);
}

/** A small label of a state; `kind` is its colour. */
export const badge = (text, kind) => element("span", { class: `badge ${kind}` }, text);

/** A button that copies a text. Browsers let pages copy that came over HTTPS or from their own machine; others get no button. */
export function copying(text, label = "Copy") {
  if (!navigator.clipboard) return null;
  const copy = element("button", { type: "button", class: "small", onclick: () => {
    navigator.clipboard.writeText(text()).then(() => say(copy, "Copied"), () => say(copy, "Not copied: select the text"));
    setTimeout(() => say(copy, label), 2000);
  } }, label);
  return copy;
}

/** Colours of robots, which are those of their accents. */
export const robotColour = (robot) => colour(["--a", "--b", "--c"][robot % 3]);
