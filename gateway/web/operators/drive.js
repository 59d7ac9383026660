// One person drives one robot. A command of a tenth of a second goes out after another, in real time; the server executes it when every
// robot has one, so that time stands still while a person's page is closed or out of view.

import { element, say } from "../src/dom.js";
import { call } from "./call.js";
import { moved, project } from "./camera.js";
import { CLOSED, OPEN, closedBy, listen, wanted } from "./inputs.js";

const TICK_STEPS = 5;
const TICK_MS = 100;
/** A picture with every so many commands. */
const PICTURE_TICKS = 2;
/** How long the others may take until the page says that it waits for them. */
const WAITING_MS = 1500;
/** A target is never further from its wrist: what is dragged against a table does not wind up. */
const LEASH_M = 0.2;
const HEIGHT_RANGE_M = [0.5, 0.78];
const SIDES = ["left", "right"];

/** Shows the page of `seat` and drives until the episode has ended. */
export async function drive(main, seat) {
  const root = `/v1/episodes/${encodeURIComponent(seat.episode)}`;
  const ask = (tool, body) => call(`${root}/tools/${tool}`, seat.token, body);
  const asked = Promise.all([call(`${root}/briefing`, seat.token), ask("observe", { robots: [seat.robot], short: true })]);
  const answered = await asked.catch((error) => error);
  if (answered instanceof Error) {
    main.replaceChildren(element("h1", {}, "Nothing to drive"), element("p", { class: "bad", role: "alert" }, answered.message),
      element("p", {}, "The link may be of another start of the server, or the episode has ended. ", element("a", { href: "/operate" }, "Start another")));
    return;
  }
  const [briefing, seen] = answered;
  const state = { seat, ask, root, hand: "right", targets: {}, measured: {}, fingers: {}, shares: {}, heightM: null, camera: null, paused: null, ended: false, gone: new Set() };
  const page = build(main, state, briefing);
  const keys = listen((key) => {
    const action = { 1: "left", 2: "right", o: "open", c: "close", " ": "clutch" }[key];
    if (action) page.act(action);
    return Boolean(action);
  });
  look(state, page, seen);
  await run(state, page, keys);
}

/** Commands until the end. */
async function run(state, page, keys) {
  for (let tick = 0; !state.ended; tick += 1) {
    if (document.hidden || state.paused) {
      page.status(state.paused ?? "Paused: this page is out of view.");
      await sleep(TICK_MS);
      continue;
    }
    const began = performance.now();
    const slow = setTimeout(() => page.status("Time stands still: a partner's page is closed or out of view."), WAITING_MS);
    try {
      hear(state, page, await together(state, command(state, keys, tick)));
    } catch (error) {
      await refused(state, page, error);
    } finally {
      clearTimeout(slow);
    }
    await sleep(TICK_MS - (performance.now() - began));
  }
}

const sleep = (ms) => new Promise((done) => setTimeout(done, Math.max(0, ms)));

/** Sends the command, and for each robot that nobody drives one to stand still. */
async function together(state, body) {
  const still = state.seat.still ? state.seat.still.split(",") : [];
  const others = still.map((token) => call(`${state.root}/tools/wait`, token, { steps: TICK_STEPS }));
  const [own] = await Promise.all([state.ask("move_wrists", body), ...others.map((other) => other.catch(() => null))]);
  return own;
}

/** The command of one tick. */
function command(state, keys, tick) {
  const want = wanted(keys);
  const tickS = TICK_MS / 1000;
  if (want.clutch) state.targets = {};
  if (!want.clutch && want.wristM_s.some((value) => value !== 0)) shift(state, state.hand, want.wristM_s.map((value) => value * tickS));
  const move = { robot: state.seat.robot, carried: true };
  for (const key of ["vx_m_s", "vy_m_s", "yaw_rate_rad_s"]) move[key] = want[key];
  if (want.heightM_s !== 0 && state.heightM !== null) {
    const [least, most] = HEIGHT_RANGE_M;
    state.heightM = Math.max(least, Math.min(most, state.heightM + want.heightM_s * tickS));
    move.pelvis_height_m = state.heightM;
  }
  for (const side of SIDES) {
    const share = want.triggers[side];
    if (share !== undefined && Math.abs(share - (state.shares[side] ?? 0)) > 0.02) {
      state.shares[side] = share;
      state.fingers[side] = closedBy(side, share);
    }
    if (state.targets[side]) move[`${side}_position_m`] = state.targets[side];
    if (state.fingers[side]) move[`${side}_fingers_rad`] = state.fingers[side];
  }
  const observe = tick % PICTURE_TICKS === 0 ? { observe: { robots: [state.seat.robot], short: true } } : {};
  return { steps: TICK_STEPS, robots: [move], ...observe };
}

/** Moves a wrist's target, no further than its leash. */
function shift(state, side, byM) {
  const at = state.measured[side];
  if (!at) return;
  const to = (state.targets[side] ?? at).map((value, axis) => value + byM[axis]);
  const away = to.map((value, axis) => value - at[axis]);
  const share = Math.min(1, LEASH_M / Math.hypot(...away));
  state.targets[side] = at.map((value, axis) => value + share * away[axis]);
}

/** What the robot sees and where its wrists are. */
function look(state, page, seen) {
  const robot = seen.states[0];
  state.camera = seen.cameras[0];
  state.heightM ??= robot.base_command.pelvis_height_m;
  for (const side of SIDES) state.measured[side] = robot[`${side}_wrist`].position_m;
  page.picture(seen.images[0].png_base64);
}

/** Takes in the reply to a command. */
function hear(state, page, reply) {
  if (reply.observation) look(state, page, reply.observation);
  const own = reply.robots.find(({ robot }) => robot === state.seat.robot);
  for (const side of SIDES) if (own?.[side].measured) state.measured[side] = own[side].measured.position_m;
  for (const { from, text } of reply.heard ?? []) page.heard(from, text);
  page.report(reply, own);
  for (const { robot, did } of reply.partners ?? []) {
    if (did === "acted") state.gone.delete(robot);
    if (did === "held_silent" && !state.gone.has(robot)) {
      state.gone.add(robot);
      state.paused = `Paused: robot ${robot}'s person has been away for very long. It stands still if you go on.`;
    }
  }
  if (["steps_done", "partner_done"].includes(reply.stop_reason)) return page.status(`Running, ${reply.time_s.toFixed(1)} s`);
  return conclude(state, page);
}

/** A refusal: the end, or a moment out of step, after which the next command is tried. */
async function refused(state, page, error) {
  page.status(error.message);
  if ([401, 403, 404, 410].includes(error.status)) state.ended = true;
  else await conclude(state, page).catch(() => null);
  if (!state.ended) await sleep(500);
}

/** Says how the episode ended, if it has. */
async function conclude(state, page) {
  const { ended } = await state.ask("get_status", {});
  if (!ended) return;
  state.ended = true;
  page.status(`The episode has ended: ${String(ended.reason ?? ended).replaceAll("_", " ")}.`);
}

/** The page; answers with what changes it. */
function build(main, state, briefing) {
  const { robot } = state.seat;
  const part = briefing.instructions.find((entry) => entry.robot === robot)?.instruction ?? "";
  const status = element("p", { role: "status", class: "operate-status" }, "Looking.");
  const image = element("img", { alt: `What robot ${robot} sees`, draggable: "false", class: "operate-seen" });
  const handles = Object.fromEntries(SIDES.map((side) => [side, element("button", { class: `handle ${side}`, "aria-label": `${side} wrist: drag` }, side[0].toUpperCase())]));
  const view = element("div", { class: "operate-view" }, image, ...Object.values(handles));
  const facts = element("p", { class: "soft" });
  const chat = element("ul", { class: "chat", "aria-live": "polite" });
  const button = (text, action, key) => element("button", { type: "button", onclick: () => act(action) }, key ? `${text} (${key})` : text);
  const which = element("span", {});
  const pause = element("button", { type: "button", onclick: () => { state.paused = state.paused ? null : "Paused by you."; label(); } });
  const text = element("input", { maxlength: 500, "aria-label": "Say to the others", placeholder: "Say to the others" });
  const heard = (from, said) => { chat.append(element("li", {}, element("strong", {}, `${from}: `), said)); chat.scrollTop = chat.scrollHeight; };
  const speak = async (event) => {
    event.preventDefault();
    const said = text.value.trim();
    if (!said) return;
    text.value = "";
    await state.ask("say", { text: said }).then(() => heard(robot, said), (error) => heard("not said", error.message));
  };

  function label() {
    say(which, `Keys move the ${state.hand} hand.`);
    say(pause, state.paused ? "Go on" : "Pause");
    for (const side of SIDES) handles[side].setAttribute("aria-pressed", String(side === state.hand));
  }
  function act(action) {
    if (SIDES.includes(action)) state.hand = action;
    if (action === "open") state.fingers[state.hand] = OPEN[state.hand];
    if (action === "close") state.fingers[state.hand] = CLOSED[state.hand];
    if (action === "clutch") state.targets = {};
    label();
  }
  const place = () => SIDES.forEach((side) => placeHandle(state, side, handles[side]));
  SIDES.forEach((side) => draggable(state, view, handles[side], side, () => { act(side); place(); }));

  main.replaceChildren(
    element("h1", {}, `You drive robot ${robot}`), element("p", {}, part), status,
    element("div", { class: "columns operate" },
      element("div", {}, view, facts),
      element("div", {},
        element("div", { class: "tools" }, button("Left hand", "left", "1"), button("Right hand", "right", "2")),
        element("div", { class: "tools" }, button("Open", "open", "O"), button("Close", "close", "C"), button("Let go of targets", "clutch", "space"), pause),
        element("p", {}, which),
        element("p", { class: "soft" }, "Drag a handle in the picture; with Shift, or by the wheel, towards you and away. Arrow keys, Page Up and Page Down move the hand. W A S D walk, Q and E turn, R and F raise and lower. Gamepad: sticks walk and turn, triggers close, bumpers let go of targets."),
        element("h2", {}, "Talk"), chat, element("form", { onsubmit: speak, class: "tools" }, text, element("button", {}, "Say")))));
  label();
  return {
    act, heard,
    status: (said) => { say(status, said); label(); },
    picture: (base64) => { image.src = `data:image/png;base64,${base64}`; place(); },
    report: (reply, own) => { place(); say(facts, factsOf(reply, own)); },
  };
}

/** What the hands do, and what is left. */
function factsOf(reply, own) {
  const hands = own ? SIDES.map((side) => {
    const { state: does, grip } = own[side];
    return [`${side} hand`, does?.replaceAll("_", " "), grip && grip !== "none" ? `grips: ${grip.replaceAll("_", " ")}` : null].filter(Boolean).join(" ");
  }) : [];
  const phases = (reply.phases ?? []).map(({ id }) => id.replaceAll("_", " "));
  return [...hands, `${(reply.budget.steps_left / 50).toFixed(0)} s left`, phases.length > 0 ? `reached: ${phases.join(", ")}` : null].filter(Boolean).join(" · ");
}

/** A handle is where its wrist is to be; at the border of the picture where that lies outside of what the robot sees. */
function placeHandle(state, side, handle) {
  const at = state.targets[side] ?? state.measured[side];
  if (!at || !state.camera) return;
  const { u, v } = project(state.camera, at);
  const share = (value, size) => `${100 * Math.max(0.04, Math.min(0.96, value / size))}%`;
  handle.style.left = share(u, state.camera.width);
  handle.style.top = share(v, state.camera.height);
}

/** Dragging moves a wrist in the plane that faces the camera; with Shift, or by the wheel, along the line of sight. */
function draggable(state, view, handle, side, changed) {
  const drag = (du, dv, awayM) => {
    const at = state.targets[side] ?? state.measured[side];
    if (!at || !state.camera) return;
    shift(state, side, moved(state.camera, project(state.camera, at).depthM, du, dv, awayM));
    changed();
  };
  handle.addEventListener("pointerdown", (event) => { handle.setPointerCapture(event.pointerId); changed(); });
  handle.addEventListener("pointermove", (event) => {
    if (!handle.hasPointerCapture(event.pointerId) || !state.camera) return;
    const pixels = state.camera.width / view.clientWidth;
    if (event.shiftKey) drag(0, 0, -event.movementY * 0.002);
    else drag(event.movementX * pixels, event.movementY * pixels, 0);
  });
  handle.addEventListener("wheel", (event) => { event.preventDefault(); drag(0, 0, -Math.sign(event.deltaY) * 0.01); }, { passive: false });
}
