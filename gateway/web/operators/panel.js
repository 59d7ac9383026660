// What the page of a person who drives is made of.

import { element, say, words } from "../src/dom.js";
import { SIDES } from "../src/message.js";
import { byTouch } from "./touch.js";

/** How a person drives. */
const WAYS = [
  ["Move a hand", "drag L or R; with Shift, or by the wheel, towards you and away; or arrow keys, Page Up and Page Down"],
  ["Turn it", "Ctrl and drag, or I K, J L, U M; Level points its fingers ahead"],
  ["Walk", "W A S D; turn by Q and E; rise and sink by R and F"],
  ["Gamepad", "sticks walk and turn, triggers close the hands, bumpers rest the arms where they are"],
];

/** The same by fingers. */
const TOUCH_WAYS = [
  ["Move a hand", "drag L or R: across what you see, in and out of it, or turning it, as the buttons between the pads say"],
  ["Walk", "push the left pad; the right one turns, and lifts and lowers the body"],
];

/** No handle is nearer to the border. */
const BORDER_PX = 32;

/** There is nothing to drive, and why. */
export function nothing(main, why) {
  main.replaceChildren(element("h1", {}, "Nothing to drive"), element("p", { class: "bad", role: "alert" }, why),
    element("p", {}, "The link may be of another start of the server, or the episode has ended. ", element("a", { href: "/operate" }, "Start another")));
}

/** Lays the page out; answers with what changes it. `pads` are for thumbs; `on` hears what the person does beside driving. */
export function layOut(main, { robot, episode, collection }, briefing, pads, on) {
  const touch = byTouch();
  const part = briefing.instructions.find((entry) => entry.robot === robot)?.instruction ?? "";
  const status = element("p", { role: "status", class: "operate-status" }, "Connecting.");
  const handles = Object.fromEntries(SIDES.map((side) => [side, element("button", { type: "button", class: `handle ${side}`, "aria-label": `${side} wrist: drag` }, side[0].toUpperCase())]));
  const border = element("div", { class: "operate-border", title: `what robot ${robot} sees` });
  const view = element("div", { class: "view" });
  const place = element("div", { class: "operate-view" }, view, border, ...Object.values(handles));
  const facts = element("p", { class: "soft" });
  const phases = new Phases(briefing.phases ?? []);
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
  const cursors = new Map();
  const size = { width: 0, height: 0 };
  new ResizeObserver(() => Object.assign(size, { width: place.clientWidth, height: place.clientHeight })).observe(place);
  return {
    view, handles,
    heard: chat.heard,
    status: (said) => say(status, said),
    /** How the episode stands, and what the hands do, as the page says it. */
    said: () => [status.textContent, facts.textContent],
    /** Shows where the robot's picture ends, if the view is the robot's. */
    border: (shown, camera, share) => {
      border.hidden = !shown;
      if (!camera) return;
      place.style.setProperty("--seen", String(camera.width / camera.height));
      place.style.setProperty("--share", String(share));
    },
    headset: (supported) => { wear.hidden = !supported; },
    handle: (side, at) => put(handles[side], at, true, size),
    /** Where a partner wants a wrist to be. */
    cursor: (name, side, at) => {
      const key = name + side;
      if (!cursors.has(key)) {
        cursors.set(key, element("span", { class: "cursor", "aria-hidden": "true" }, `${name} ${side[0].toUpperCase()}`));
        place.append(cursors.get(key));
      }
      put(cursors.get(key), at, false, size);
    },
    facts: (reply, own) => {
      say(facts, factsOf(reply, own));
      phases.show(new Map((reply.phases ?? []).map(({ number, time_s: timeS }) => [number, timeS])));
    },
    /** The episode is over: what has come of it, and where it is found. */
    ended: (result) => {
      const reached = Object.entries(result.phases ?? {}).filter(([, timeS]) => timeS !== null);
      phases.show(new Map(reached), true);
      const isComplete = result.ended === "task_complete";
      status.classList.toggle("good", isComplete);
      say(status, isComplete ? "Done: the task is complete." : `The episode has ended: ${words(result.ended)}.`);
      controls.hidden = true;
      for (const control of [...Object.values(handles), ...thumbs]) control.hidden = true;
      for (const cursor of cursors.values()) cursor.hidden = true;
      chat.close();
      if (!collection) after.replaceChildren(...whereFound(episode));
    },
    label: ({ hand, paused, stepwise: steps }) => {
      say(pause, paused ? "Go on" : "Pause");
      step.hidden = !steps;
      for (const side of SIDES) for (const chooses of [handles[side], which[side]]) chooses.setAttribute("aria-pressed", String(side === hand));
    },
  };
}

/** What is asked, phase by phase, where the server tells it. */
class Phases {
  constructor(phases) {
    this.times = new Map(phases.map(({ number }) => [number, element("span", { class: "soft" }, "not yet")]));
    this.rows = new Map(phases.map(({ number, id, description }) => [number, element("li", {},
      element("span", { title: description }, `${number} ${words(id)}`, element("span", { class: "what soft" }, description)), this.times.get(number))]));
    this.node = element("section", { hidden: phases.length === 0 }, element("h2", {}, "Phases"), element("ol", { class: "phases" }, ...this.rows.values()));
  }

  /** Those of `reached` have been, at these times; the others not yet, or, once it is `over`, never. */
  show(reached, over = false) {
    for (const [number, row] of this.rows) {
      const timeS = reached.get(number);
      row.classList.toggle("done", timeS !== undefined);
      const time = this.times.get(number);
      time.className = timeS === undefined ? "soft" : "good";
      say(time, timeS === undefined ? (over ? "not reached" : "not yet") : `${timeS.toFixed(1)} s`);
    }
  }
}

/** Where an episode that is over is found again. */
function whereFound(episode) {
  return [
    element("p", {}, "Its recording is ", element("code", {}, episode), " in the server's folder of runs. ",
      element("a", { href: `/watch?run=${encodeURIComponent(episode)}` }, "Look at it again"), ", if you have the link to watch, which the server printed when it started."),
    element("p", {}, element("a", { href: "/operate" }, "Start another episode")),
  ];
}

/** What is clicked takes no focus, and a text that had it loses it, so that keys drive; who comes by the keyboard gives it. */
function keepKeys(event) {
  if (!event.target.closest("button:not(.handle), input[type=checkbox], label")) return;
  event.preventDefault();
  document.activeElement?.blur();
}

/** Puts something where it is seen; a handle that lies outside of the picture is at its border, and other things are not shown. It is
 * moved by what needs no layout and no painting. */
function put(thing, { x, y, ahead }, always, size) {
  const inside = ahead && Math.abs(x) <= 1 && Math.abs(y) <= 1;
  thing.hidden = !inside && !always;
  // What lies behind is seen mirrored.
  const [u, v] = ahead ? [x, y] : [-x, -Math.abs(y) - 1];
  const within = (share, length) => Math.max(BORDER_PX, Math.min(length - BORDER_PX, share * length)).toFixed(1);
  thing.style.transform = `translate(${within((1 + u) / 2, size.width)}px, ${within((1 - v) / 2, size.height)}px) ${always ? "translate(-50%, -50%)" : "translate(-50%, .8rem)"}`;
}

/** What people say to each other. */
function talk(robot, speak) {
  const chat = element("ul", { class: "chat", "aria-live": "polite" });
  const text = element("input", { maxlength: 500, "aria-label": "Say to the others", placeholder: "Say to the others" });
  const heard = (from, said) => { chat.append(element("li", {}, element("strong", {}, `${from}: `), said)); chat.scrollTop = chat.scrollHeight; };
  const submit = (event) => {
    event.preventDefault();
    const said = text.value.trim();
    if (!said) return;
    text.value = "";
    // Keys drive again.
    text.blur();
    speak(said).then((reply) => { heard(robot, said); (reply.heard ?? []).forEach((word) => heard(word.from, word.text)); }, (error) => heard("not said", error.message));
  };
  const form = element("form", { onsubmit: submit, class: "tools" }, text, element("button", {}, "Say"));
  return { heard, elements: [chat, form], close: () => { form.hidden = true; } };
}

/** What the hands do, and what is left. */
function factsOf(reply, own) {
  const hands = own ? SIDES.map((side) => {
    const { state: does, grip } = own[side];
    return [`${side} hand`, does && words(does), grip && grip !== "none" ? `grips: ${words(grip)}` : null].filter(Boolean).join(" ");
  }) : [];
  const reached = (reply.phases ?? []).map(({ id }) => words(id));
  return [...hands, `${(reply.budget.steps_left / 50).toFixed(0)} s left`, reached.length > 0 ? `reached: ${reached.join(", ")}` : null].filter(Boolean).join(" · ");
}
