// Parts of the page of a person who drives.

import { element, reasonOf, say, words } from "../src/dom.js";
import { SIDES, bySide } from "../src/message.js";
import { byTouch } from "./touch.js";

/** Ways to drive by keyboard and mouse. */
const WAYS = [
  ["Move a hand", "drag L or R; with Shift, or by the wheel, towards you and away; or arrow keys, Page Up and Page Down"],
  ["Turn it", "Ctrl and drag, or I K, J L, U M; Level points its fingers ahead"],
  ["Walk", "W A S D; turn by Q and E; rise and sink by R and F"],
  ["Gamepad", "sticks walk and turn, triggers close the hands, bumpers rest the arms where they are"],
];

/** Ways to drive by fingers. */
const TOUCH_WAYS = [
  ["Move a hand", "drag L or R: across what you see, in and out of it, or turning it, as the buttons between the pads say"],
  ["Walk", "push the left pad; the right one turns, and lifts and lowers the body"],
];

/** Minimum distance of a handle from the border. */
const BORDER_PX = 32;

/** Shows the reason why there is no robot to drive. @param {HTMLElement} main @param {string} why */
export function nothing(main, why) {
  main.replaceChildren(element("h1", {}, "Nothing to drive"), element("p", { class: "bad", role: "alert" }, why),
    element("p", {}, "The link may be of another start of the server, or the episode has ended. ", element("a", { href: "/operate" }, "Start another")));
}

/** @typedef {import("../src/message.js").Side} Side */
/** @typedef {{ x: number, y: number, ahead: boolean }} Seen Place in the view, from -1 to 1. */
/** @typedef {{ number: string, id: string, description: string }} PhaseInfo */
/** @typedef {{ instructions: { robot: string, instruction: string }[], phases?: PhaseInfo[] }} Briefing */
/** @typedef {Record<Side, { state?: string, grip?: string }>} OwnReport Report on the hands of a robot. */
/**
 * Report on a command.
 * @typedef {{
 *   time_s: number, budget: { steps_left: number }, robots: (OwnReport & { robot: string })[],
 *   phases?: { number: string, id: string, time_s: number }[], heard?: { from: string, text: string }[],
 *   partners?: { robot: string, did: string }[],
 * }} Report
 */
/**
 * Actions of a person other than driving.
 * @typedef {{
 *   act: (action: string) => void, speak: (text: string) => Promise<{ heard?: { from: string, text: string }[] }>, finish: () => void, look: (view: string) => void,
 *   wear: () => void, stepwise: (on: boolean) => void,
 * }} Acts
 */

/**
 * Lays the page out, and returns functions that change it. `pads` are for thumbs; `on` receives the person's actions other than driving.
 * @param {HTMLElement} main
 * @param {import("./wheel.js").EpisodeSeat} seat
 * @param {Briefing} briefing
 * @param {HTMLElement[]} pads
 * @param {Acts} on
 */
export function layOut(main, { robot, episode, collection }, briefing, pads, on) {
  const touch = byTouch();
  const part = briefing.instructions.find((entry) => entry.robot === robot)?.instruction ?? "";
  const status = element("p", { role: "status", class: "operate-status" }, "Connecting.");
  const handles = bySide((side) => element("button", { type: "button", class: `handle ${side}`, "aria-label": `${side} wrist: drag` }, side[0].toUpperCase()));
  const border = element("div", { class: "operate-border", title: `what robot ${robot} sees` });
  const view = element("div", { class: "view" });
  const place = element("div", { class: "operate-view" }, view, border, ...Object.values(handles));
  const facts = element("p", { class: "soft" });
  const phases = new Phases(briefing.phases ?? []);
  /** @type {(text: string, action: string, key?: string, title?: string) => HTMLButtonElement} */
  const button = (text, action, key, title) => element("button", { type: "button", title, onclick: () => on.act(action) }, key && !touch ? `${text} (${key})` : text);
  const pause = button("Pause", "pause");
  const step = button("Step", "step", "Enter");
  const which = { left: button("Left hand", "left", "1", "Keys and buttons are for the left hand"), right: button("Right hand", "right", "2", "Keys and buttons are for the right hand") };
  const chat = talk(robot, on.speak);
  const looks = element("select", { "aria-label": "View", onchange: (event) => { on.look(event.target.value); event.target.blur(); } },
    element("option", { value: "robot" }, `as robot ${robot} looks`), element("option", { value: "free" }, "from anywhere"));
  const wear = element("button", { type: "button", hidden: true, onclick: () => on.wear() }, "Enter VR");
  const stepwise = element("input", { type: "checkbox", onchange: (event) => on.stepwise(event.target.checked) });
  const after = element("div");
  const fingers = element("div", { class: "tools fingers" },
    button("Open", "open", "O", "Opens the fingers of this hand"), button("Close", "close", "C", "Closes the fingers of this hand"),
    button("Level", "level", "H", "Turns this hand so that its fingers point ahead and its palm inwards"),
    button("Rest here", "clutch", "space", "Both arms stay as they are: where the hands were to go is forgotten"));
  const thumbs = touch ? [...pads, fingers] : [];
  const controls = element("div", {},
    element("div", { class: "tools" }, looks, element("label", {}, stepwise, " step by step"), step, wear),
    element("div", { class: "tools", role: "group", "aria-label": "The hand that keys and buttons are for" }, which.left, which.right),
    touch ? null : fingers,
    element("div", { class: "tools" }, pause,
      element("button", { type: "button", title: "Your part is done: the episode ends when everybody has finished", onclick: () => on.finish() }, "Finish")),
    element("ul", { class: "ways soft" }, ...(touch ? TOUCH_WAYS : WAYS).map(([what, how]) => element("li", {}, element("strong", {}, `${what}: `), how))));
  main.replaceChildren(
    element("h1", {}, `You drive robot ${robot}`), element("p", {}, part), status, after,
    element("div", { class: `columns operate${touch ? " touch" : ""}`, onmousedown: keepKeys },
      element("div", {}, element("div", { class: "cockpit" }, place, ...thumbs), facts),
      element("div", { class: "side" }, controls, element("h2", {}, "Talk"), ...chat.elements),
      phases.node));
  /** @type {Map<string, HTMLElement>} */
  const cursors = new Map();
  const size = { width: 0, height: 0 };
  new ResizeObserver(() => Object.assign(size, { width: place.clientWidth, height: place.clientHeight })).observe(place);
  return {
    view, handles,
    heard: chat.heard,
    status: (/** @type {string} */ said) => say(status, said),
    /** Returns the page's text about the state of the episode and of the hands. */
    said: () => [status, facts].map((line) => line.textContent ?? ""),
    /** Shows the border of the robot's picture, if the view is the robot's. @param {boolean} shown */
    border: (shown) => { border.hidden = !shown; },
    /**
     * Sets the camera of the robot, and the share of the height that its picture takes.
     * @param {import("../src/message.js").CameraHead} camera
     * @param {number} share
     */
    camera: (camera, share) => {
      place.style.setProperty("--seen", String(camera.width / camera.height));
      place.style.setProperty("--share", String(share));
    },
    headset: (/** @type {boolean} */ supported) => { wear.hidden = !supported; },
    handle: (/** @type {Side} */ side, /** @type {Seen} */ at) => put(handles[side], at, true, size),
    /** Shows a partner's wrist target. @param {string} name @param {Side} side @param {Seen} at */
    cursor: (name, side, at) => {
      const key = name + side;
      let cursor = cursors.get(key);
      if (!cursor) {
        cursor = element("span", { class: "cursor", "aria-hidden": "true" }, `${name} ${side[0].toUpperCase()}`);
        cursors.set(key, cursor);
        place.append(cursor);
      }
      put(cursor, at, false, size);
    },
    /** Shows a report on a command. @param {Report} reply @param {OwnReport | undefined} own */
    facts: (reply, own) => {
      say(facts, factsOf(reply, own));
      phases.show(new Map((reply.phases ?? []).map(({ number, time_s: timeS }) => [number, timeS])));
    },
    /**
     * Shows that the episode is over, with its outcome and its address.
     * @param {import("./wheel.js").Ended} result
     */
    ended: (result) => {
      phases.show(new Map(Object.entries(result.phases ?? {})), true);
      const isComplete = result.ended === "task_complete";
      status.classList.toggle("good", isComplete);
      say(status, isComplete ? "Done: the task is complete." : `The episode has ended: ${words(result.ended)}.`);
      controls.hidden = true;
      for (const control of [...Object.values(handles), ...thumbs]) control.hidden = true;
      for (const cursor of cursors.values()) cursor.hidden = true;
      chat.close();
      if (!collection) after.replaceChildren(...whereFound(episode));
    },
    /**
     * Shows the chosen hand, and the mode of time: automatic or stepwise.
     * @param {{ hand: Side, paused: string | null, stepwise: boolean }} how
     */
    label: ({ hand, paused, stepwise: steps }) => {
      say(pause, paused ? "Go on" : "Pause");
      step.hidden = !steps;
      for (const side of SIDES) for (const chooses of [handles[side], which[side]]) chooses.setAttribute("aria-pressed", String(side === hand));
    },
  };
}

/** The list of phases, if the server discloses them. */
class Phases {
  /** @param {PhaseInfo[]} phases */
  constructor(phases) {
    this.rows = phases.map(({ number, id, description }) => {
      const time = element("span", { class: "soft" }, "not yet");
      const row = element("li", {},
        element("span", { title: description }, `${number} ${words(id)}`, element("span", { class: "what soft" }, description)), time);
      return { number, row, time };
    });
    this.node = element("section", { hidden: phases.length === 0 }, element("h2", {}, "Phases"),
      element("ol", { class: "phases" }, ...this.rows.map(({ row }) => row)));
  }

  /**
   * Shows the phases of `reached` that have a time as done. The others are shown as open or, once it is `over`, as missed.
   * @param {Map<string, number | null>} reached
   * @param {boolean} [over]
   */
  show(reached, over = false) {
    for (const { number, row, time } of this.rows) {
      const timeS = reached.get(number) ?? null;
      row.classList.toggle("done", timeS !== null);
      time.className = timeS === null ? "soft" : "good";
      say(time, timeS === null ? (over ? "not reached" : "not yet") : `${timeS.toFixed(1)} s`);
    }
  }
}

/** Shows the address of a finished episode. @param {string} episode */
function whereFound(episode) {
  return [
    element("p", {}, "Its recording is ", element("code", {}, episode), " in the server's folder of runs. ",
      element("a", { href: `/watch?run=${encodeURIComponent(episode)}` }, "Look at it again"), ", if you have the link to watch, which the server printed when it started."),
    element("p", {}, element("a", { href: "/operate" }, "Start another episode")),
  ];
}

/**
 * Keeps a clicked element from getting the focus, and removes the focus from a text, so that keys drive. The Tab key still
 * moves the focus.
 * @param {MouseEvent} event
 */
function keepKeys(event) {
  if (!(event.target instanceof Element) || !event.target.closest("button:not(.handle), input[type=checkbox], label")) return;
  event.preventDefault();
  if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
}

/**
 * Moves an element to its place in the view. A handle outside of the picture is put at its border; other elements are hidden. The
 * motion uses a property that needs no layout and no painting.
 * @param {HTMLElement} thing
 * @param {Seen} at
 * @param {boolean} always
 * @param {{ width: number, height: number }} size
 */
function put(thing, { x, y, ahead }, always, size) {
  const inside = ahead && Math.abs(x) <= 1 && Math.abs(y) <= 1;
  thing.hidden = !inside && !always;
  // Points behind the camera appear mirrored.
  const [u, v] = ahead ? [x, y] : [-x, -Math.abs(y) - 1];
  const within = (/** @type {number} */ share, /** @type {number} */ length) => Math.max(BORDER_PX, Math.min(length - BORDER_PX, share * length)).toFixed(1);
  thing.style.transform = `translate(${within((1 + u) / 2, size.width)}px, ${within((1 - v) / 2, size.height)}px) ${always ? "translate(-50%, -50%)" : "translate(-50%, .8rem)"}`;
}

/**
 * Makes the list of people's messages, and its form.
 * @param {string} robot
 * @param {Acts["speak"]} speak
 */
function talk(robot, speak) {
  const chat = element("ul", { class: "chat", "aria-live": "polite" });
  const text = element("input", { maxlength: 500, "aria-label": "Say to the others", placeholder: "Say to the others" });
  const heard = (/** @type {string} */ from, /** @type {string} */ said) => { chat.append(element("li", {}, element("strong", {}, `${from}: `), said)); chat.scrollTop = chat.scrollHeight; };
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    const said = text.value.trim();
    if (!said) return;
    text.value = "";
    // Keys drive again.
    text.blur();
    speak(said).then((reply) => { heard(robot, said); (reply.heard ?? []).forEach((word) => heard(word.from, word.text)); }, (error) => heard("not said", reasonOf(error)));
  };
  const form = element("form", { onsubmit: submit, class: "tools" }, text, element("button", {}, "Say"));
  return { heard, elements: [chat, form], close: () => { form.hidden = true; } };
}

/** Returns the text about the hands and the remaining budget. @param {Report} reply @param {OwnReport | undefined} own */
function factsOf(reply, own) {
  const hands = own ? SIDES.map((side) => {
    const { state: does, grip } = own[side];
    return [`${side} hand`, does && words(does), grip && grip !== "none" ? `grips: ${words(grip)}` : null].filter(Boolean).join(" ");
  }) : [];
  const reached = (reply.phases ?? []).map(({ id }) => words(id));
  return [...hands, `${(reply.budget.steps_left / 50).toFixed(0)} s left`, reached.length > 0 ? `reached: ${reached.join(", ")}` : null].filter(Boolean).join(" · ");
}
