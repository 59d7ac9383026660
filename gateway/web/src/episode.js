// The page of one episode, running or finished.

import { Calls } from "./calls.js";
import { badge } from "./cards.js";
import { ask, element, say, words } from "./dom.js";
import { Frame, readScene } from "./message.js";
import { Plots } from "./plots.js";
import { Stage } from "./stage.js";
import { Targets } from "./targets.js";
import { LiveTime, RecordedTime } from "./time.js";

const PLOTS_EVERY_MS = 250;
const CAMERAS_EVERY_MS = 1000;
const RECONNECT_MS = 2000;
/** Where drawing takes longer, it is made simpler. */
const SLOW_FRAME_MS = 60;

/** @param {HTMLElement} main @param {{ episode?: string, run?: string, at?: number }} wanted */
export async function episode(main, wanted) {
  const query = wanted.run ? `run=${encodeURIComponent(wanted.run)}` : `episode=${encodeURIComponent(wanted.episode)}`;
  const scene = readScene(await (await ask(`/watch/${wanted.run ? "run" : "scene"}?${query}`)).arrayBuffer());
  new EpisodePage(main, wanted, query, scene).begin();
}

class EpisodePage {
  constructor(main, wanted, query, scene) {
    const { head, frames } = scene;
    Object.assign(this, { wanted, query, scene, head, recorded: Boolean(wanted.run) });
    document.title = `${words(head.task)}, seed ${head.seed}`;
    this.reached = new Map(head.reached.map((phase) => [phase.number, phase.time_s]));
    this.result = head.result;
    this.time = this.recorded ? new RecordedTime(frames, wanted.at) : new LiveTime(frames[0]);
    this.targets = this.recorded ? new Targets(scene) : null;
    this.plots = new Plots(head, this.targets);
    this.calls = new Calls(head, this.recorded ? (time) => this.time.seek(time) : null);
    this.layOut(main);
    this.stage = new Stage(this.view, scene);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.stage.paint(); this.plotsDue = true; });
    for (const call of head.calls) this.calls.add(call);
    for (const frame of frames) this.plots.add(frame);
    this.plotsDue = true;
    this.showPhases();
    this.showEnd();
  }

  begin() {
    if (!this.recorded) this.connect();
    let last = performance.now();
    let slow = 0;
    const tick = (now) => {
      const passed = Math.min((now - last) / 1000, 0.5);
      // A page in the background is not drawn, and so is not slow.
      slow = now - last > SLOW_FRAME_MS && now - last < 1000 ? slow + 1 : 0;
      if (slow === 20) this.stage.simplify();
      last = now;
      this.draw(passed);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
    setInterval(() => this.drawPlots(), PLOTS_EVERY_MS);
    setInterval(() => this.drawCameras(), CAMERAS_EVERY_MS);
  }

  layOut(main) {
    const { head } = this;
    this.view = element("div", { class: "view" });
    this.state = element("span");
    this.facts = element("dl", { class: "facts" });
    this.phases = element("ol", { class: "phases" });
    this.problem = element("p", { class: "bad", role: "alert" });
    this.cameras = element("div", { class: "pictures" });
    this.look = element("input", { type: "checkbox", id: "look", onchange: () => this.drawCameras() });
    main.replaceChildren(
      element("header", { class: "top" },
        element("a", { href: "/watch" }, "All episodes"),
        element("h1", {}, words(head.task)), this.state,
        element("span", { class: "soft" }, `seed ${head.seed}, ${head.protocol}, assistance ${head.assistance}`)),
      element("p", { class: "soft" }, head.instruction),
      this.problem,
      element("div", { class: "columns" },
        element("section", { class: "stage", "aria-label": "The episode in three dimensions" },
          this.tools(), this.view, this.recorded ? this.scrubber() : null, this.key()),
        element("section", { class: "side", "aria-label": "How it stands" },
          this.facts, element("h2", {}, "Phases"), this.phases,
          element("h2", {}, element("label", { for: "look" }, this.look, " What the robots see")), this.cameras,
          this.recorded ? this.files() : null)),
      element("section", {}, element("h2", {}, "Hands and joints"), this.plots.node),
      element("section", {}, element("h2", {}, "Calls, the latest first"), this.calls.node));
  }

  /** Who looks, and what is shown beside the scene. */
  tools() {
    const views = [["free", "Free camera"], ...this.head.robots.map(({ name }) => [name, `As robot ${name}`])];
    const choose = element("select", { "aria-label": "Camera", onchange: (event) => {
      this.stage.look(event.target.value);
      this.again = true;
    } },
      ...views.map(([value, text]) => element("option", { value }, text)));
    const extras = [["targets", "targets"], ["forces", "forces"], ["frustums", "fields of view"]].map(([name, text]) =>
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

  scrubber() {
    const { time } = this;
    this.play = element("button", { onclick: () => this.toggle() }, "Play");
    this.slider = element("input", {
      type: "range", min: time.begin, max: time.end, step: 0.02, "aria-label": "Moment",
      oninput: (event) => { time.play(false); time.seek(Number(event.target.value)); },
    });
    this.moment = element("output");
    const marks = element("div", { class: "marks" }, ...[...this.reached].map(([number, at]) => {
      const mark = element("button", { title: `${number} reached at ${at.toFixed(2)} s`, onclick: () => time.seek(at) }, number);
      mark.style.left = `${(100 * (at - time.begin)) / (time.end - time.begin)}%`;
      return mark;
    }));
    const speed = element("select", { "aria-label": "Speed", onchange: (event) => { time.speed = Number(event.target.value); } },
      ...[0.25, 1, 4, 10].map((factor) => element("option", { value: factor, selected: factor === 1 }, `${factor}x`)));
    addEventListener("keydown", (event) => {
      if (event.target.closest("input, select, button, summary, a, textarea")) return;
      if (event.key === " ") this.toggle();
      else if (event.key === "ArrowLeft") time.seek(time.time - 0.1);
      else if (event.key === "ArrowRight") time.seek(time.time + 0.1);
      else return;
      event.preventDefault();
    });
    return element("div", { class: "scrubber" }, this.play, element("div", { class: "track" }, this.slider, marks), speed, this.moment);
  }

  toggle() {
    this.time.play(!this.time.playing);
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
    return element("div", {}, element("h2", {}, "Film and files"), show, film,
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
        // It was closed, and its folder may have a recording by now.
        this.closed = true;
        this.showEnd();
        return;
      }
      const still = await ask("/watch/episodes").then((answer) => answer.json()).catch(() => null);
      if (still && !still.held.some(({ episode_id: id }) => id === this.wanted.episode)) {
        say(this.problem, "The server holds this episode no more.");
        this.closed = true;
        this.showEnd();
        return;
      }
      say(this.problem, "The connection broke; trying again.");
      setTimeout(() => this.connect(), RECONNECT_MS);
    });
  }

  told(event) {
    if (event.kind === "call") this.calls.add(event);
    if (event.kind === "phase") {
      this.reached.set(event.phase.number, event.phase.time_s);
      this.showPhases();
    }
    if (event.kind === "ended") {
      this.result = event.result;
      this.showEnd();
    }
  }

  shown(data) {
    const row = new Float32Array(data.slice(0, data.byteLength - (data.byteLength % 4)));
    if (row[0] === 2) {
      this.calls.picture(row[1], row[2], data.slice(12));
      return;
    }
    const frame = new Frame(row, this.scene.layout);
    this.time.add(frame);
    this.plots.add(frame);
    this.plots.trim();
    this.plotsDue = true;
  }

  draw(seconds) {
    const { from, to, share, moved } = this.time.pass(seconds);
    if (moved || this.again || !this.drawn) {
      this.stage.show(from, to, share, this.targets);
      this.showFacts(to);
      this.drawn = true;
      this.again = false;
      if (this.recorded) this.plotsDue = true;
    }
    if (this.recorded) {
      if (document.activeElement !== this.slider || this.time.playing) this.slider.value = this.time.time;
      say(this.moment, `${this.time.time.toFixed(2)} of ${this.time.end.toFixed(1)} s`);
      say(this.play, this.time.playing ? "Pause" : "Play");
    }
    this.stage.draw();
  }

  drawPlots() {
    if (!this.plotsDue || document.hidden) return;
    this.plotsDue = false;
    this.plots.draw(this.recorded ? this.time.time : null, [...this.reached.values()]);
  }

  /** True pictures, drawn by the server as the robots see them. */
  async drawCameras() {
    if (!this.look.checked) {
      this.cameras.replaceChildren();
      this.pictured = null;
      return;
    }
    const time = this.time.time.toFixed(2);
    if (document.hidden || this.closed || this.drawing || this.pictured === time) return;
    this.drawing = true;
    this.pictured = time;
    const pictures = this.head.robots.map(async ({ name }) => {
      const answer = await ask(`/watch/camera?${this.query}&robot=${encodeURIComponent(name)}&time_s=${time}`);
      const image = element("img", { alt: `What robot ${name} sees` });
      image.src = URL.createObjectURL(await answer.blob());
      await image.decode();
      URL.revokeObjectURL(image.src);
      return element("figure", {}, image, element("figcaption", {}, name));
    });
    try {
      this.cameras.replaceChildren(...await Promise.all(pictures));
    } catch (error) {
      this.cameras.replaceChildren(element("p", { class: "bad" }, error.message));
    }
    this.drawing = false;
  }

  showPhases() {
    this.phases.replaceChildren(...this.head.phases.map(({ number, id, collaborative }) => {
      const at = this.reached.get(number);
      return element("li", { class: at === undefined ? "" : "done" },
        element("span", {}, `${number} ${words(id)}`, collaborative ? element("span", { class: "soft" }, " together") : null),
        element("span", { class: at === undefined ? "soft" : "good" }, at === undefined ? "not yet" : `${at.toFixed(2)} s`));
    }));
  }

  showFacts(frame) {
    const facts = [["time", `${this.time.time.toFixed(1)} s`], ["step", `${Math.round(frame.step)}`]];
    const left = this.recorded ? this.head.episode_steps - frame.step : frame.stepsLeft;
    if (left >= 0) facts.push(["steps left", `${Math.round(left)}`]);
    if (frame.clockLeft >= 0) facts.push(["to think", `${frame.clockLeft.toFixed(0)} s`]);
    this.head.robots.forEach(({ name }, index) => frame.fallen(index) && facts.push([`robot ${name}`, "has fallen"]));
    const text = facts.join();
    if (text === this.factsText) return;
    this.factsText = text;
    this.facts.replaceChildren(...facts.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value))));
  }

  showEnd() {
    const { result } = this;
    if (!result && this.closed) return this.state.replaceChildren(badge("closed", ""));
    if (!result) return this.state.replaceChildren(badge(this.recorded ? "interrupted" : "live", this.recorded ? "bad" : "live"));
    const missing = this.head.phases.length - this.reached.size;
    this.state.replaceChildren(badge(words(result.ended), missing ? "bad" : "good"));
    if (this.closed) {
      say(this.problem, "");
      this.state.append(" ", element("a", { href: `/watch?run=${encodeURIComponent(this.wanted.episode)}` }, "Look at it again"));
    }
  }
}
