// The controls of a recorded time: play, speed, keys, and a link to the shown moment.

import { copying, element, say } from "./dom.js";

const SPEEDS = [0.25, 1, 4, 10];
/** Step of the arrow keys. */
const STEP_S = 0.1;
/** Time without a change after which the moment is written to the address. Browsers refuse frequent changes. */
const SETTLED_MS = 400;

/** The controls of a recorded time. */
export class Player {
  /**
   * @param {import("./time.js").RecordedTime} time
   * @param {((way: number) => void) | null} step goes to the call before or after, where there are calls
   */
  constructor(time, step = null) {
    this.time = time;
    this.play = element("button", { class: "play", onclick: () => this.toggle() }, "Play");
    this.moment = element("output");
    /** @type {number | undefined} */
    this.shown = undefined;
    /** @type {number | undefined} */
    this.settling = undefined;
    const call = (/** @type {number} */ way, /** @type {string} */ text, /** @type {string} */ title) =>
      step && element("button", { title, "aria-label": title, onclick: () => step(way) }, text);
    const speed = element(
      "select",
      {
        "aria-label": "Speed",
        onchange: (event) => {
          time.speed = Number(event.target.value);
        },
      },
      ...SPEEDS.map((factor) => element("option", { value: factor, selected: factor === 1 }, `${factor}x`)),
    );
    this.node = element(
      "div",
      { class: "tools" },
      call(-1, "◀", "The call before"),
      this.play,
      call(1, "▶", "The next call"),
      speed,
      this.moment,
      copying(() => this.address(), "Copy link to this moment"),
    );
    addEventListener("keydown", (event) => {
      const { target } = event;
      if (target instanceof Element && target.closest("input, select, button, summary, a, textarea")) return;
      if (event.key === " ") this.toggle();
      else if (event.key === "ArrowLeft") time.seek(time.time - STEP_S);
      else if (event.key === "ArrowRight") time.seek(time.time + STEP_S);
      else if (event.key === "p" && step) step(-1);
      else if (event.key === "n" && step) step(1);
      else return;
      event.preventDefault();
    });
  }

  toggle() {
    this.time.play(!this.time.playing);
  }

  /** Returns the page's address with the shown moment. */
  address() {
    const url = new URL(location.href);
    url.searchParams.set("at", this.time.time.toFixed(2));
    return url.href;
  }

  /** Shows the moment. Once it has settled, it is written to the page's address. */
  show() {
    say(this.moment, `${this.time.time.toFixed(2)} of ${this.time.end.toFixed(1)} s`);
    say(this.play, this.time.playing ? "Pause" : "Play");
    const before = this.shown;
    this.shown = this.time.time;
    if (before === undefined || before === this.shown || this.time.playing) return;
    clearTimeout(this.settling);
    this.settling = setTimeout(() => history.replaceState(null, "", this.address()), SETTLED_MS);
  }
}
