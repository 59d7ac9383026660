// The start page at `/`, and the list of episodes at `/watch`.

import { call, statusOf } from "../operators/call.js";
import { element, say } from "../src/dom.js";
import { Connect } from "./connect.js";
import { Feed } from "./feed.js";
import { Finished } from "./finished.js";
import { Running } from "./running.js";
import { Tasks } from "./tasks.js";

/** Links of the start page for servers on which a visitor may start episodes. */
const STARTING = ["#tasks", "/operate"];

/** Shows the start page. @param {HTMLElement} main */
export function home(main) {
  document.title = "Tandem";
  const token = element("input", { type: "password", name: "token", autocomplete: "off" });
  const [running, finished, connect] = [new Running(), new Finished(), new Connect()];
  const tasks = new Tasks(token, (started) => {
    connect.show(started);
    feed.look();
  });
  const feed = new Feed(running, finished, token);
  const starts = main.hasAttribute("data-starts");
  const front = element("img", { alt: "" });
  const lock = element(
    "form",
    {
      class: "ask",
      hidden: true,
      onsubmit: (event) => {
        event.preventDefault();
        load();
      },
    },
    element("label", {}, element("span", {}, "The server's token"), token),
    element("button", { class: "primary" }, "Open"),
  );
  const load = async () => {
    try {
      const list = await call("/v1/tasks", token.value);
      say(feed.problem, "");
      lock.hidden = true;
      if (starts) tasks.take(list.tasks, front);
    } catch (error) {
      if (statusOf(error) !== 401) throw error;
      if (token.value) say(feed.problem, "That is not the server's token.");
      lock.hidden = false;
      connect.show({ locked: true });
    }
  };
  main.replaceChildren(
    hero(main.dataset.version, starts, front),
    feed.problem,
    lock,
    running.node,
    running.evaluated,
    tasks.node,
    connect.node,
    element("div", { id: "episodes" }, feed.door, finished.node),
  );
  feed.start();
  load().catch((error) => say(feed.problem, error.message));
}

/** Shows the list of episodes for visitors with the watch link. @param {HTMLElement} main */
export function episodes(main) {
  document.title = "Tandem: episodes";
  const [running, finished] = [new Running(), new Finished()];
  const feed = new Feed(running, finished, { value: "" });
  main.replaceChildren(
    element(
      "header",
      { class: "top" },
      element("h1", {}, "Episodes"),
      feed.version,
      element("a", { href: "/" }, "Tasks, and how to connect an agent"),
      element("a", { href: "/operate" }, "Drive robots yourself"),
    ),
    feed.problem,
    running.node,
    running.evaluated,
    finished.node,
  );
  feed.start();
}

/** @param {string | undefined} version @param {boolean} starts @param {HTMLElement} front */
function hero(version, starts, front) {
  const links = [
    ["#running", "Running"],
    ["#tasks", "Tasks"],
    ["#connect", "Connect"],
    ["#episodes", "Finished"],
    ["/operate", "Operate"],
    ["/docs", "Interface"],
    ["/v1/openapi.json", "OpenAPI"],
  ].filter(([href]) => starts || !STARTING.includes(href));
  const actions = element(
    "p",
    { class: "actions" },
    element("a", { class: "action large primary", href: "#tasks" }, "Start an episode"),
    element("a", { class: "action large", href: "#connect" }, "Connect an agent"),
    element("a", { class: "action large", href: "/operate" }, "Drive robots yourself"),
  );
  return element(
    "header",
    { class: "hero" },
    element(
      "nav",
      { "aria-label": "This server" },
      ...links.map(([href, text]) => element("a", { href }, text)),
    ),
    element(
      "div",
      {},
      element("h1", {}, "Tandem ", element("small", {}, version)),
      element(
        "p",
        {},
        "Humanoid robots that have to work together. Watch them, drive them, or let an agent play.",
      ),
      starts ? actions : null,
    ),
    starts ? element("div", { class: "picture" }, front) : null,
  );
}
