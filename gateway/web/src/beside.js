// Two finished episodes side by side on one clock.

import { ask, badge, element, endOf, words, watchedTexture } from "./dom.js";
import { readScene } from "./message.js";
import { Player } from "./player.js";
import { Pace, Stage } from "./stage/stage.js";
import { Targets } from "./targets.js";
import { RecordedTime } from "./time.js";

/** Duration of a frame of both above which drawing is simplified. */
const SLOW_FRAME_MS = 80;

/** @typedef {import("./message.js").WatchedScene} WatchedScene */

/**
 * Shows the episodes of two folders from a moment.
 * @param {HTMLElement} main
 * @param {string[]} runs
 * @param {number} at
 */
export async function besideEachOther(main, runs, at) {
  /** @type {Side[]} */
  const sides = [];
  for (const run of runs) {
    const answer = await ask(`/watch/run?run=${encodeURIComponent(run)}`);
    sides.push(new Side(run, /** @type {WatchedScene} */ (readScene(await answer.arrayBuffer())), at));
  }
  document.title = `${sides.map(({ title }) => title).join(" beside ")}`;
  const clock = sides.map(({ time }) => time).reduce((one, other) => (one.end >= other.end ? one : other));
  const slider = element("input", {
    type: "range",
    min: clock.begin,
    max: clock.end,
    step: 0.02,
    "aria-label": "Moment",
    oninput: () => {
      clock.play(false);
      clock.seek(Number(slider.value));
    },
  });
  const player = new Player(clock);
  main.replaceChildren(
    element(
      "header",
      { class: "top" },
      element("a", { href: "/watch" }, "All episodes"),
      element("h1", {}, "Side by side"),
    ),
    element("div", { class: "beside" }, ...sides.map(({ node }) => node)),
    element("div", { class: "scrubber" }, player.node, element("div", { class: "track" }, slider)),
  );
  const stages = sides.map((side) => side.begin());
  turnTogether(stages);
  const pace = new Pace(SLOW_FRAME_MS);
  let last = performance.now();
  const tick = (/** @type {number} */ now) => {
    const { moved } = clock.pass(Math.min((now - last) / 1000, 0.5));
    const drawn = sides.map((side, index) => side.draw(stages[index], clock.time, moved));
    if (drawn.some(Boolean) && pace.isSlow(now - last)) for (const stage of stages) stage.simplify();
    if (document.activeElement !== slider || clock.playing) slider.value = String(clock.time);
    player.show();
    last = now;
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

/** One of the two episodes. */
class Side {
  /** @param {string} run @param {WatchedScene} scene @param {number} at */
  constructor(run, scene, at) {
    const { head, frames } = scene;
    this.scene = scene;
    this.time = new RecordedTime(frames, at);
    this.targets = new Targets(scene);
    this.drawn = false;
    this.reached = new Map(head.reached.map(({ number, time_s: timeS }) => [number, timeS]));
    this.title = `${words(head.task)}, seed ${head.seed}`;
    this.view = element("div", { class: "view" });
    this.phases = head.phases.map((phase) => this.phase(phase));
    const done = head.reached.length === head.phases.length;
    this.node = element(
      "section",
      { "aria-label": `${this.title}, ${run}` },
      element(
        "div",
        { class: "top" },
        element("h2", {}, element("a", { href: `/watch?run=${encodeURIComponent(run)}` }, this.title)),
        badge(head.result ? endOf(head.result) : "interrupted", done ? "good" : "bad"),
      ),
      element("p", { class: "soft id" }, `${run}, ${head.protocol}, ${this.time.end.toFixed(1)} s`),
      this.view,
      element("ol", { class: "phases" }, ...this.phases),
    );
  }

  /** @param {import("./message.js").Phase} phase */
  phase({ number, id }) {
    const at = this.reached.get(number);
    return element(
      "li",
      { "data-at": at ?? Infinity },
      element("span", {}, `${number} ${words(id)}`),
      element("span", { class: "soft" }, at === undefined ? "not reached" : `${at.toFixed(2)} s`),
    );
  }

  /** Begins to draw. The view has to be in the page. Returns its stage. */
  begin() {
    const stage = new Stage(this.view, this.scene, watchedTexture);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => stage.paint());
    return stage;
  }

  /**
   * Shows a moment of the clock. An episode that is over stays at its end. Returns true if it was drawn.
   * @param {Stage} stage
   * @param {number} moment
   * @param {boolean} moved
   */
  draw(stage, moment, moved) {
    if (moved || !this.drawn) {
      this.time.seek(moment);
      const { from, to, share } = this.time.pass(0);
      stage.show(from, to, share, this.targets);
      for (const phase of this.phases)
        phase.classList.toggle("done", Number(phase.dataset.at) <= moment + 1e-6);
      this.drawn = true;
    }
    return stage.draw();
  }
}

/** Makes the camera of each view follow the other one. @param {Stage[]} stages */
function turnTogether(stages) {
  let following = false;
  stages.forEach(({ free, controls }, index) => {
    const other = stages[1 - index];
    controls.addEventListener("change", () => {
      if (following) return;
      following = true;
      other.free.position.copy(free.position);
      other.controls.target.copy(controls.target);
      other.controls.update();
      other.stale = true;
      following = false;
    });
  });
}
