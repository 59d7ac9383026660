// `/`: the start page. `/watch`: the episodes as cards, each on its own page, and two side by side. `/operate`: people drive robots.

import { episodes, home } from "../home/main.js";
import { besideEachOther } from "./beside.js";
import { element } from "./dom.js";
import { episode } from "./episode.js";
import { operate } from "../operators/main.js";

const main = /** @type {HTMLElement} */ (document.getElementById("main"));
const wanted = new URLSearchParams(location.search);

const page = async () => {
  if (location.pathname.startsWith("/operate")) return operate(main);
  if (location.pathname === "/") return home(main);
  const [held, run, other] = ["episode", "run", "beside"].map((name) => wanted.get(name));
  const at = Number(wanted.get("at")) || 0;
  if (held) return episode(main, { episode: held });
  if (run && other) return besideEachOther(main, [run, other], at);
  if (run) return episode(main, { run, at });
  return episodes(main);
};

page().catch((error) => {
  main.replaceChildren(
    element("p", {}, element("a", { href: "/watch" }, "All episodes")),
    element("h1", {}, "Nothing to show"),
    element("p", { class: "bad", role: "alert" }, error.message));
});
