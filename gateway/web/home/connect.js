// "Connect an agent": lines to copy for programs and language models.

import { copying, element, say, words } from "../src/dom.js";
import { waysToConnect } from "./lines.js";

/** @typedef {Parameters<typeof waysToConnect>[0]} Given */

/** The section of lines to copy. */
export class Connect {
  constructor() {
    /** @type {Given} */
    this.given = { url: location.origin, locked: false, task: "handover", seed: 0 };
    this.about = element("p", { class: "soft", role: "status" });
    this.panels = waysToConnect(this.given).map(({ name, hint }) => {
      const text = element("code");
      const node = element(
        "article",
        { class: "card way" },
        element(
          "div",
          { class: "line" },
          element("h3", {}, name),
          copying(() => text.textContent),
        ),
        element("div", { class: "soft" }, hint),
        element("pre", { tabindex: 0, "aria-label": `Lines for ${name}` }, text),
      );
      return { node, text };
    });
    this.node = element(
      "section",
      { id: "connect", "aria-labelledby": "connect-title" },
      element("h2", { id: "connect-title" }, "Connect an agent"),
      this.about,
      element("div", { class: "cards wide" }, ...this.panels.map(({ node }) => node)),
    );
    this.show({});
  }

  /**
   * Applies changes: task and seed, an episode that was started here, or the need for a token.
   * @param {Partial<Given>} changed
   */
  show(changed) {
    Object.assign(this.given, changed);
    const { task, episode, locked } = this.given;
    const token = locked ? " They read the server's token from the variable TANDEM_TOKEN." : "";
    say(
      this.about,
      (episode
        ? `These lines play ${episode}, which you have started; a language model begins one of its own.`
        : `These lines begin an episode of ${words(task)}. To play another, start it from its task.`) + token,
    );
    waysToConnect(this.given).forEach(({ text }, index) => say(this.panels[index].text, text));
  }
}
