// The page of one episode, running or finished.

import { ask, badge, element, endOf, reasonOf, say, words, watchedTexture } from "./dom.js";
import { Frame, readScene } from "./message.js";
import { Player } from "./player.js";
import { BudgetPlots, Plots } from "./plots.js";
import { Pace, Stage } from "./stage/stage.js";
import { Story } from "./story.js";
import { Targets } from "./targets.js";
import { LiveTime, RecordedTime } from "./time.js";
import { Timeline } from "./timeline.js";

const PLOTS_EVERY_MS = 250;
const CAMERAS_EVERY_MS = 1000;
const RECONNECT_MS = 2000;
/** Duration of a frame above which drawing is simplified. */
const SLOW_FRAME_MS = 60;

/**
 * @typedef {{ episode: string, run?: undefined, at?: undefined } | { run: string, at: number, episode?: undefined }} Wanted
 */

/**
 * Shows a running episode, or a finished one from a moment.
 * @param {HTMLElement} main
 * @param {Wanted} wanted
 */
export async function episode(main, wanted) {
  const query = wanted.run === undefined ? `episode=${encodeURIComponent(wanted.episode)}` : `run=${encodeURIComponent(wanted.run)}`;
  const answer = await ask(`/watch/${wanted.run === undefined ? "scene" : "run"}?${query}`);
  const scene = /** @type {import("./message.js").WatchedScene} */ (readScene(await answer.arrayBuffer()));
  new EpisodePage(main, wanted, query, scene).begin();
}

class EpisodePage {
  view = element("div", { class: "view" });
  state = element("span");
  facts = element("dl", { class: "facts" });
  factsText = "";
  phases = element("ol", { class: "phases" });
  problem = element("p", { class: "bad", role: "alert" });
  cameras = element("div", { class: "pictures" });
  look = element("input", { type: "checkbox", id: "look", onchange: () => this.drawCameras() });
  /** Key of the pictures that were requested last. */
  pictured = "";
  /** True while a request for pictures is under way. */
  drawing = false;
  /** True once the server no longer holds the episode. */
  closed = false;
  drawn = false;
  /** True if the same moment has to be drawn again. */
  again = false;
  plotsDue = true;
  /** @type {{ number: string, lacks: string[] } | undefined} */
  next = undefined;

  /**
   * @param {HTMLElement} main
   * @param {Wanted} wanted
   * @param {string} query
   * @param {import("./message.js").WatchedScene} scene
   */
  constructor(main, wanted, query, scene) {
    const { head, frames } = scene;
    /** Id of a running episode, or folder of a finished one. */
    this.id = wanted.run ?? wanted.episode;
    this.query = query;
    this.scene = scene;
    this.head = head;
    document.title = `${words(head.task)}, seed ${head.seed}`;
    this.reached = new Map(head.reached.map((phase) => [phase.number, phase.time_s]));
    this.result = head.result;
    const recorded = wanted.run === undefined ? null : new RecordedTime(frames, wanted.at);
    /** The time of a finished episode. */
    this.recorded = recorded;
    this.time = recorded ?? new LiveTime(frames[0]);
    this.targets = recorded && new Targets(scene);
    this.plots = new Plots(head, this.targets);
    this.story = new Story(head, recorded && {
      seek: (time) => { recorded.play(false); recorded.seek(time); },
      picture: (robot, time) => this.cameraPath(robot, time),
    });
    const timeline = recorded && new Timeline(head, recorded, frames);
    this.timeline = timeline;
    this.player = timeline && new Player(recorded, (way) => timeline.step(way));
    this.budget = recorded && new BudgetPlots(head, frames);
    this.layOut(main);
    this.stage = new Stage(this.view, scene, watchedTexture);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.stage.paint(); this.plotsDue = true; });
    for (const entry of head.story) this.story.add(entry);
    for (const frame of frames) this.plots.add(frame);
    this.showPhases();
    this.showEnd();
  }

  begin() {
    if (!this.recorded) this.connect();
    let last = performance.now();
    const pace = new Pace(SLOW_FRAME_MS);
    const tick = (/** @type {number} */ now) => {
      const passed = Math.min((now - last) / 1000, 0.5);
      if (this.draw(passed) && pace.isSlow(now - last)) this.stage.simplify();
      last = now;
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
    setInterval(() => this.drawPlots(), PLOTS_EVERY_MS);
    setInterval(() => this.drawCameras(), CAMERAS_EVERY_MS);
  }

  /** @param {HTMLElement} main */
  layOut(main) {
    const { head } = this;
    main.replaceChildren(
      element("header", { class: "top" },
        element("a", { href: "/watch" }, "All episodes"),
        element("h1", {}, words(head.task)), this.state,
        element("span", { class: "soft" }, `seed ${head.seed}, ${head.protocol}, assistance ${head.assistance}`)),
      element("p", { class: "soft" }, head.instruction),
      this.problem,
      element("div", { class: "columns" },
        element("section", { class: "stage", "aria-label": "The episode in three dimensions" },
          this.tools(), this.view, this.scrubber(), this.key()),
        element("section", { class: "side", "aria-label": "How it stands" },
          this.facts, this.recorded ? null : element("h2", {}, "Phases"), this.recorded ? null : this.phases,
          this.recorded ? element("h2", {}, "What happened") : null, this.recorded ? this.story.node : null,
          element("h2", {}, this.recorded ? "What the robots saw" : element("label", { for: "look" }, this.look, " What the robots see")),
          this.recorded ? element("p", { class: "soft" }, element("label", { for: "look" }, this.look, " drawn at this moment, whether the policy looked or not")) : null,
          this.cameras)),
      ...(this.budget ? [element("section", {}, element("h2", {}, "Budget"), this.budget.node)] : []),
      element("section", {}, element("h2", {}, "Hands and joints"), this.plots.node),
      this.recorded ? this.files() : element("section", {}, element("h2", {}, "Calls and notes, the latest first"), this.story.node));
  }

  /** Makes the choice of the camera, and of the panel beside the scene. */
  tools() {
    const views = [["free", "Free camera"], ...this.head.robots.map(({ name }) => [name, `As robot ${name}`])];
    const choose = element("select", { "aria-label": "Camera", onchange: (event) => {
      this.stage.look(event.target.value);
      this.again = true;
    } },
      ...views.map(([value, text]) => element("option", { value }, text)));
    /** @type {["targets" | "forces" | "frustums", string][]} */
    const shown = [["targets", "targets"], ["forces", "forces"], ["frustums", "fields of view"]];
    const extras = shown.map(([name, text]) =>
      element("label", {}, element("input", { type: "checkbox", checked: true, onchange: (event) => {
        this.stage.extras[name] = event.target.checked;
        this.again = true;
      } }), ` ${text}`));
    return element("div", { class: "tools" }, choose, ...extras);
  }

  key() {
    const states = [["moving", "accent"], ["arrived", "good"], ["blocked", "bad"], ["out of reach", "odd"], ["joints told", "soft"]];
    return element("p", { class: "legend" }, element("span", {}, "A wrist's target, where it is 1 cm away or more:"),
      ...states.map(([text, kind]) => element("span", {}, element("i", { class: `swatch ${kind}` }), text)),
      element("span", {}, element("i", { class: "swatch force" }), "force of what a hand touches"),
      element("span", {}, "in a robot's colour: the force that it feels"));
  }

  /** Makes the controls of a finished episode's time; null for a running episode. */
  scrubber() {
    if (!this.player || !this.timeline) return null;
    this.player.node.append(this.taking());
    return element("div", { class: "scrubber" }, this.player.node, this.timeline.node);
  }

  /**
   * Makes the button that continues from the shown moment, as a new episode whose robots people
   * drive.
   */
  taking() {
    const go = () => {
      const { time } = this.time;
      const from = new URLSearchParams({ run: this.id, at: time.toFixed(2), task: this.head.task, seed: String(this.head.seed), protocol: this.head.protocol });
      location.assign(`/operate?${from}`);
    };
    return element("button", { class: "take", title: "People drive the robots from here on, in an episode of its own", onclick: go }, "Take over here");
  }

  files() {
    const at = `/watch/file?${this.query}&file=`;
    const film = element("div");
    const show = element("button", { onclick: () => {
      show.disabled = true;
      say(show, "The film is drawn");
      const image = element("img", { src: `/watch/film?${this.query}`, alt: "Film of the episode" });
      image.addEventListener("load", () => show.remove());
      image.addEventListener("error", () => say(show, "No film can be made"));
      film.replaceChildren(image);
    } }, "Show its film");
    const links = [["episode.mcap", "recording"], ["result.json", "result"], ["strip.png", "strip"], ["report.html", "report"]];
    return element("section", {}, element("h2", {}, "Film and files"), show, film,
      element("p", {}, ...links.flatMap(([file, text], index) =>
        [index ? ", " : "", element("a", { href: at + file, download: file === "episode.mcap" ? file : null }, text)])),
      element("img", { src: `${at}strip.png`, alt: "Key moments", loading: "lazy" }));
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/watch/live?${this.query}`);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }) => (typeof data === "string" ? this.told(JSON.parse(data)) : this.shown(data)));
    socket.addEventListener("open", () => say(this.problem, ""));
    socket.addEventListener("close", async () => {
      if (this.result) {
        // The episode was closed, and its folder may contain a recording by now.
        this.closed = true;
        this.showEnd();
        return;
      }
      /** @type {import("../home/feed.js").Lists | null} */
      const still = await ask("/watch/episodes").then((answer) => answer.json()).catch(() => null);
      if (still && !still.held.some(({ episode_id: id }) => id === this.id)) {
        say(this.problem, "The server holds this episode no more.");
        this.closed = true;
        this.showEnd();
        return;
      }
      say(this.problem, "The connection broke; trying again.");
      setTimeout(() => this.connect(), RECONNECT_MS);
    });
  }

  /** Receives an event. @param {any} event */
  told(event) {
    if (event.kind === "call" || event.kind === "note") this.story.add(event);
    if (event.kind === "phase") {
      this.reached.set(event.phase.number, event.phase.time_s);
      this.showPhases();
    }
    if (event.kind === "next_phase") {
      this.next = event.phase;
      this.showPhases();
    }
    if (event.kind === "ended") {
      this.result = event.result;
      this.showEnd();
    }
  }

  /** Receives a step or a picture. @param {ArrayBuffer} data */
  shown(data) {
    const row = new Float32Array(data.slice(0, data.byteLength - (data.byteLength % 4)));
    if (row[0] === 2) {
      this.story.picture(row[1], row[2], data.slice(12));
      return;
    }
    const frame = new Frame(row, this.scene.layout);
    if (this.time instanceof LiveTime) this.time.add(frame);
    this.plots.add(frame);
    this.plots.trim();
    this.plotsDue = true;
  }

  /**
   * Shows the state after `seconds` more. Returns true if the scene was drawn again.
   * @param {number} seconds
   */
  draw(seconds) {
    const { from, to, share, moved } = this.time.pass(seconds);
    if (moved || this.again || !this.drawn) {
      this.stage.show(from, to, share, this.targets);
      this.showFacts(to);
      this.drawn = true;
      this.again = false;
      if (this.recorded) this.plotsDue = true;
    }
    this.timeline?.show();
    if (this.recorded) this.story.follow(this.time.time);
    this.player?.show();
    return this.stage.draw();
  }

  drawPlots() {
    if (!this.plotsDue || document.hidden) return;
    this.plotsDue = false;
    this.plots.draw(this.recorded ? this.time.time : null, [...this.reached.values()]);
    this.budget?.draw(this.time.time, [...this.reached.values()]);
  }

  /** @param {string} robot @param {number | string} time */
  cameraPath(robot, time) {
    return `/watch/camera?${this.query}&robot=${encodeURIComponent(robot)}&time_s=${time}`;
  }

  /**
   * Returns the pictures to show: of a finished episode those that the policy was shown last, unless
   * the reader has chosen all pictures of this moment.
   */
  wantedPictures() {
    const { time } = this.time;
    const at = (/** @type {string} */ name, /** @type {number} */ moment, /** @type {string} */ told) => ({ name, told, moment: moment.toFixed(2) });
    if (this.look.checked) return this.head.robots.map(({ name }) => at(name, time, ""));
    if (!this.recorded) return [];
    return this.head.robots.flatMap(({ name }) => {
      const look = this.head.story.findLast((entry) => entry.time_s <= time + 1e-6 && entry.seen?.includes(name));
      return look ? [at(name, look.time_s, `, call ${look.number} at ${look.time_s.toFixed(1)} s`)] : [];
    });
  }

  /** Shows the robots' camera images, which the server draws. */
  async drawCameras() {
    const wanted = this.wantedPictures();
    const key = JSON.stringify(wanted);
    if (document.hidden || this.closed || this.drawing || this.pictured === key) return;
    this.drawing = true;
    this.pictured = key;
    const pictures = wanted.map(async ({ name, told, moment }) => {
      const answer = await ask(this.cameraPath(name, moment));
      const image = element("img", { alt: `What robot ${name} sees` });
      image.src = URL.createObjectURL(await answer.blob());
      await image.decode();
      URL.revokeObjectURL(image.src);
      return element("figure", {}, image, element("figcaption", {}, `${name}${told}`));
    });
    try {
      this.cameras.replaceChildren(...await Promise.all(pictures));
      if (!wanted.length && this.recorded) this.cameras.append(element("p", { class: "soft" }, "The policy has not looked yet."));
    } catch (error) {
      this.cameras.replaceChildren(element("p", { class: "bad" }, reasonOf(error)));
    }
    this.drawing = false;
  }

  showPhases() {
    this.phases.replaceChildren(...this.head.phases.map(({ number, id, collaborative }) => {
      const at = this.reached.get(number);
      return element("li", { class: at === undefined ? "" : "done" },
        element("span", {}, `${number} ${words(id)}`, collaborative ? element("span", { class: "soft" }, " together") : null,
          at === undefined && this.next?.number === number ? lacking(this.next.lacks) : null),
        element("span", { class: at === undefined ? "soft" : "good" }, at === undefined ? "not yet" : `${at.toFixed(2)} s`));
    }));
  }

  /** @param {Frame} frame */
  showFacts(frame) {
    const facts = [["time", `${this.time.time.toFixed(1)} s`], ["step", `${Math.round(frame.step)}`]];
    const left = this.recorded ? this.head.episode_steps - frame.step : frame.stepsLeft;
    if (left >= 0) facts.push(["steps left", `${Math.round(left)}`]);
    if (frame.clockLeft >= 0) facts.push(["left to think", `${frame.clockLeft.toFixed(0)} s`]);
    if (this.recorded) facts.push(...this.soFar());
    this.head.robots.forEach(({ name }, index) => frame.fallen(index) && facts.push([`robot ${name}`, "has fallen"]));
    const text = facts.join();
    if (text === this.factsText) return;
    this.factsText = text;
    this.facts.replaceChildren(...facts.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value))));
  }

  /** Shows the budget used up to the shown moment. */
  soFar() {
    const told = this.head.story.filter((entry) => entry.time_s <= this.time.time + 1e-6);
    const calls = told.filter(({ kind, number }) => kind === "call" && number !== null).length;
    const facts = [["calls", `${calls}`], ["thought", `${(told.at(-1)?.thought_s ?? 0).toFixed(0)} s`]];
    const sum = (/** @type {(note: import("./message.js").Note) => number | undefined} */ of) => told.reduce((total, { note }) => total + ((note && of(note)) ?? 0), 0);
    const [tokens, usd] = [sum((note) => (note.input_tokens ?? 0) + (note.output_tokens ?? 0)), sum((note) => note.usd)];
    if (tokens) facts.push(["tokens", tokens < 1e5 ? `${tokens}` : `${(tokens / 1000).toFixed(0)}k`]);
    if (usd) facts.push(["price", `$${usd.toFixed(usd < 0.1 ? 3 : 2)}`]);
    return facts;
  }

  showEnd() {
    const { result } = this;
    if (!result) {
      const [text, kind] = this.recorded ? ["interrupted", "bad"] : ["live", "live"];
      this.state.replaceChildren(this.closed ? badge("closed", "") : badge(text, kind));
      return;
    }
    const missing = this.head.phases.length - this.reached.size;
    this.state.replaceChildren(badge(endOf(result), missing ? "bad" : "good"));
    if (this.closed) {
      say(this.problem, "");
      this.state.append(" ", element("a", { href: `/watch?run=${encodeURIComponent(this.id)}` }, "Look at it again"));
    }
  }
}

/** Lists the missing conditions of the next phase, measured by the simulator. @param {string[]} lacks */
const lacking = (lacks) => element("ul", { class: "lacks soft" }, ...lacks.map((lack) => element("li", {}, lack)));
