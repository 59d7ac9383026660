// The socket by which a page drives: what the robot is to do goes out up to 50 times a second; the scene, every control step and what came
// of the commands come back.

import { Frame, readScene } from "../src/message.js";
import { Refused, call } from "./call.js";

const RETRY_MS = 1000;

export class Wheel {
  /**
   * @param {{ episode: string, robot: string, token: string, still?: string }} seat
   * @param {{ scene: (scene: ReturnType<typeof readScene>) => void, frame: (frame: Frame) => void, told: (message: any) => void, lost: (why: string) => void }} heard
   */
  constructor(seat, heard) {
    this.seat = seat;
    this.heard = heard;
    this.over = false;
    this.layout = null;
  }

  /** Opens the socket, and opens it again when it is lost, until the episode is over. */
  async connect() {
    try {
      const robots = await enter(this.seat);
      if (this.over) return;
      this.socket = new WebSocket(`${location.origin.replace("http", "ws")}/operate/drive?robots=${robots}`);
    } catch (error) {
      this.retry(error instanceof Refused ? error.message : "The server cannot be reached.");
      return;
    }
    this.layout = null;
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => this.hear(data);
    this.socket.onclose = () => this.retry("The link is lost; time stands still.");
  }

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

  /** Says what the robot is to do from now on. What a slow link has not taken yet is better said later. */
  say(word) {
    if (this.socket?.readyState === WebSocket.OPEN && this.socket.bufferedAmount < 4096) this.socket.send(JSON.stringify(word));
  }

  /** Tries again, unless the episode has ended meanwhile. */
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

/** How the episode has ended, if it has. */
async function hasEnded({ episode, token }) {
  try {
    const { ended } = await call(`/v1/episodes/${encodeURIComponent(episode)}/tools/get_status`, token, {});
    return ended ? String(ended.reason ?? ended) : null;
  } catch (error) {
    return [401, 403, 404, 410].includes(error.status) ? "it is not held any more" : null;
  }
}

/** The robots that a page drives or lets stand still, its own first, with their tokens. */
function robotsOf({ robot, token, still }) {
  return [[robot, token], ...(still ? still.split(",").map((pair) => pair.split(".")) : [])];
}

/** The tokens of these robots. */
export const tokensOf = (seat) => robotsOf(seat).map(([, token]) => token);

/** Has the browser keep a cookie for each of these robots: a socket is asked for without headers. */
async function enter(seat) {
  await Promise.all(tokensOf(seat).map((token) => call("/operate/enter", token, {}, { credentials: "same-origin" })));
  return robotsOf(seat).map(([robot]) => robot).join(",");
}
