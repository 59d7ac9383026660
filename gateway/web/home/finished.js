// Finished episodes as cards, filters over them, and the choice of two to play side by side.

import { element, say, words } from "../src/dom.js";
import { AGES, NAMES, RESULTS, chosenIn, counted, filtered, policyOf, withChoice } from "./filters.js";
import { finishedCard } from "./finished_card.js";

/** Number of cards that are shown at first, and added at each press. */
const PAGE_CARDS = 12;

/** @typedef {import("./filters.js").FinishedEpisode} FinishedEpisode */
/** @typedef {HTMLInputElement | HTMLSelectElement} Field */

/** The section of finished episodes. */
export class Finished {
  constructor() {
    /** @type {FinishedEpisode[]} */
    this.entries = [];
    /** @type {Map<string, { key: string, card: HTMLElement }>} */
    this.cards = new Map();
    this.choice = chosenIn(location.search);
    this.shown = PAGE_CARDS;
    /**
     * The episodes to compare, at most two.
     * @type {{ run: string, name: string, button: HTMLElement }[]}
     */
    this.beside = [];
    this.count = element("p", { class: "soft", role: "status" });
    this.grid = element("div", { class: "cards" });
    this.more = element(
      "button",
      {
        type: "button",
        class: "large",
        hidden: true,
        onclick: () => {
          this.shown += PAGE_CARDS;
          this.list();
        },
      },
      "Show more",
    );
    const { filters, fields } = this.form();
    this.filters = filters;
    this.fields = fields;
    this.pair = element("div", { class: "pair", role: "status", hidden: true });
    this.node = element(
      "section",
      { id: "finished", "aria-labelledby": "finished-title" },
      element("h2", { id: "finished-title" }, "Finished"),
      this.filters,
      this.count,
      this.grid,
      this.more,
      this.pair,
    );
  }

  /** Makes the form of the filters, and its fields by name. */
  form() {
    /**
     * @type {(name: string, label: string, options: [string, string, ...unknown[]][]) => [string, HTMLElement, Field]}
     */
    const select = (name, label, options) => {
      const field = element(
        "select",
        { name, onchange: () => this.choose() },
        element("option", { value: "" }, "any"),
        ...options.map(([value, text]) => element("option", { value }, text)),
      );
      return [name, element("label", {}, element("span", {}, label), field), field];
    };
    const text = element("input", {
      type: "search",
      name: "text",
      placeholder: "task, seed, policy, folder",
      oninput: () => this.choose(),
    });
    /** @type {[string, HTMLElement, Field][]} */
    const rows = [
      ["text", element("label", {}, element("span", {}, "Find"), text), text],
      select("task", "Task", []),
      select("policy", "Policy", []),
      select("result", "Result", RESULTS),
      select("age", "Ended in", AGES),
    ];
    const filters = element(
      "form",
      {
        class: "filters",
        role: "search",
        "aria-label": "Finished episodes",
        onsubmit: (event) => event.preventDefault(),
      },
      ...rows.map(([, label]) => label),
      element("button", { type: "button", onclick: () => this.clear() }, "Clear"),
    );
    return { filters, fields: Object.fromEntries(rows.map(([name, , field]) => [name, field])) };
  }

  /** Shows a new list. @param {FinishedEpisode[]} entries */
  take(entries) {
    this.entries = entries;
    this.options("task", ({ result }) => result.task, words);
    this.options("policy", policyOf, (name) => name);
    for (const name of NAMES) this.fields[name].value = this.choice[name];
    this.list();
  }

  /**
   * Offers the values that occur. A value that the address selects stays, even without episodes.
   * @param {string} name
   * @param {(entry: FinishedEpisode) => string} valueOf
   * @param {(value: string) => string} told
   */
  options(name, valueOf, told) {
    const values = counted(this.entries, valueOf);
    const chosen = this.choice[name];
    if (chosen && !values.some(([value]) => value === chosen)) values.push([chosen, 0]);
    const key = JSON.stringify(values);
    if (this.fields[name].dataset.key === key) return;
    this.fields[name].dataset.key = key;
    this.fields[name].replaceChildren(
      element("option", { value: "" }, "any"),
      ...values.map(([value, count]) => element("option", { value }, `${told(value)} (${count})`)),
    );
  }

  choose() {
    this.choice = Object.fromEntries(NAMES.map((name) => [name, this.fields[name].value]));
    this.shown = PAGE_CARDS;
    history.replaceState(
      null,
      "",
      location.pathname + withChoice(location.search, this.choice) + location.hash,
    );
    this.list();
  }

  clear() {
    for (const name of NAMES) this.fields[name].value = "";
    this.choose();
    this.fields.text.focus();
  }

  list() {
    const found = filtered(this.entries, this.choice, Date.now() / 1000);
    const all = this.entries.length;
    this.filters.hidden = all === 0;
    say(
      this.count,
      all === 0
        ? ""
        : `${found.length === all ? all : `${found.length} of ${all}`} ${all === 1 ? "episode" : "episodes"}`,
    );
    /** @type {HTMLElement[]} */
    const cards = found.slice(0, this.shown).map((entry) => this.card(entry));
    this.more.hidden = found.length <= this.shown;
    if (!all)
      cards.push(
        element(
          "p",
          { class: "soft" },
          "None yet. ",
          element("code", {}, "tandem demo"),
          ", run in the folder of this server, plays one within seconds.",
        ),
      );
    else if (!cards.length)
      cards.push(element("p", { class: "soft" }, "No episode fits. Clear the filters to see all of them."));
    // Cards that remain keep their images, and the focus.
    const same =
      cards.length === this.grid.children.length &&
      cards.every((card, index) => card === this.grid.children[index]);
    if (!same) this.grid.replaceChildren(...cards);
  }

  /** @param {FinishedEpisode} entry */
  card(entry) {
    const key = JSON.stringify(entry);
    const known = this.cards.get(entry.run);
    if (known?.key === key) return known.card;
    const card = finishedCard(entry, entry.recorded ? this.besideButton(entry) : null);
    this.cards.set(entry.run, { key, card });
    return card;
  }

  /** @param {FinishedEpisode} entry */
  besideButton(entry) {
    const name = `${words(entry.result.task)}, seed ${entry.result.seed}`;
    const button = element(
      "button",
      {
        type: "button",
        class: "small",
        "aria-pressed": "false",
        "aria-label": `Compare ${name}, ${entry.run}`,
        onclick: () => {
          const chosen = this.beside.some(({ run }) => run === entry.run);
          this.beside = chosen
            ? this.beside.filter(({ run }) => run !== entry.run)
            : [...this.beside.slice(-1), { run: entry.run, name, button }];
          this.showPair();
        },
      },
      "Compare",
    );
    return button;
  }

  /** Shows the episodes to compare, and the link once there are two. */
  showPair() {
    for (const button of this.grid.querySelectorAll("[aria-pressed]"))
      button.setAttribute("aria-pressed", "false");
    for (const { button } of this.beside) button.setAttribute("aria-pressed", "true");
    this.pair.hidden = !this.beside.length;
    const [one, other] = this.beside;
    const names = element("span", {}, this.beside.map(({ name }) => name).join(" and "));
    const query = other && new URLSearchParams({ run: one.run, beside: other.run });
    this.pair.replaceChildren(
      names,
      other
        ? element("a", { class: "action primary", href: `/watch?${query}` }, "Play side by side")
        : element("span", { class: "soft" }, "Choose a second one."),
      element(
        "button",
        {
          type: "button",
          onclick: () => {
            this.beside = [];
            this.showPair();
          },
        },
        "Cancel",
      ),
    );
  }
}
