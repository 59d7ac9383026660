// The socket by which a page drives. It sends setpoints up to 50 times a second, and receives the scene, every control step and the
// outcomes of commands.

import { Frame, readScene } from "../src/message.js";
import { Refused, call, statusOf } from "./call.js";

const RETRY_MS = 1000;

/** @typedef {import("./main.js").Seat & { episode: string }} EpisodeSeat Seat of an episode that is known. */
/**
 * End of an episode, in the form for its drivers.
 * @typedef {{ ended: string, phases?: Record<string, number | null> }} Ended
 */

/** The socket of one page. */
export class Wheel {
  /** @type {import("../src/message.js").Layout | null} */
  layout = null;
  over = false;
  /** @type {WebSocket | undefined} */
  socket = undefined;

  /**
   * @param {EpisodeSeat} seat
   * @param {{ scene: (scene: import("../src/message.js").Scene) => void, frame: (frame: Frame) => void, told: (message: any) => void, lost: (why: string) => void }} heard
   */
  constructor(seat, heard) {
    this.seat = seat;
    this.heard = heard;
  }

  /** Opens the socket, and reopens it after a loss, until the episode is over. */
  async connect() {
    try {
      const robots = await enter(this.seat);
      if (this.over) return;
      this.layout = null;
      this.socket = new WebSocket(`${location.origin.replace("http", "ws")}/operate/drive?robots=${robots}`);
      this.socket.binaryType = "arraybuffer";
      this.socket.onmessage = ({ data }) => this.hear(data);
      this.socket.onclose = () => this.retry("The link is lost; time stands still.");
    } catch (error) {
      this.retry(error instanceof Refused ? error.message : "The server cannot be reached.");
    }
  }

  /** Receives a message. @param {string | ArrayBuffer} data */
  hear(data) {
    if (typeof data === "string") {
      const message = JSON.parse(data);
      if (message.kind === "ended" || message.kind === "replaced") this.close();
      this.heard.told(message);
    } else if (this.layout) {
      this.heard.frame(new Frame(new Float32Array(data), this.layout));
    } else {
      const scene = readScene(data);
      this.layout = scene.layout;
      this.heard.scene(scene);
      this.heard.frame(scene.frames[0]);
    }
  }

  /**
   * Sends the present setpoints of the robot. While a slow connection has unsent data, they are sent later.
   * @param {unknown} word
   */
  say(word) {
    if (this.socket?.readyState === WebSocket.OPEN && this.socket.bufferedAmount < 4096) this.socket.send(JSON.stringify(word));
  }

  /** Tries again, unless the episode has ended meanwhile. @param {string} why */
  async retry(why) {
    if (this.over) return;
    const ended = await hasEnded(this.seat);
    if (this.over) return;
    if (ended) {
      this.close();
      this.heard.told({ kind: "ended", result: { ended } });
      return;
    }
    this.heard.lost(why);
    setTimeout(() => this.over || this.connect(), RETRY_MS);
  }

  close() {
    this.over = true;
    this.socket?.close();
  }
}

/** Requests the end of the episode; null if it has not ended. @param {EpisodeSeat} seat */
async function hasEnded({ episode, token }) {
  try {
    const { ended } = await call(`/v1/episodes/${encodeURIComponent(episode)}/tools/get_status`, token, {});
    return ended ? String(ended.reason ?? ended) : null;
  } catch (error) {
    return [401, 403, 404, 410].includes(statusOf(error) ?? 0) ? "it is not held any more" : null;
  }
}

/**
 * Lists the robots that a page drives or lets stand still, its own first, with their tokens.
 * @param {EpisodeSeat} seat
 */
function robotsOf({ robot, token, still }) {
  return [[robot, token], ...(still ? still.split(",").map((pair) => pair.split(".")) : [])];
}

/** Returns the tokens of these robots. @param {EpisodeSeat} seat */
export const tokensOf = (seat) => robotsOf(seat).map(([, token]) => token);

/**
 * Stores a cookie for each of these robots, because a socket is requested without headers. Returns their
 * names.
 * @param {EpisodeSeat} seat
 */
async function enter(seat) {
  await Promise.all(tokensOf(seat).map((token) => call("/operate/enter", token, {}, { credentials: "same-origin" })));
  return robotsOf(seat).map(([robot]) => robot).join(",");
}
