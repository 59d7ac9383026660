// A person without a browser: drives a robot over the socket that pages drive by, and hears what they hear. And one who watches.
import WebSocket from "ws";
import { lengthOf, posesIn } from "./rows.mjs";

/** What a page says so often. */
const SAY_MS = 20;

const headOf = (data) => JSON.parse(data.subarray(4, 4 + data.readUInt32LE(0)).toString());
const rowOf = (data) => new Float32Array(data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength));

/** Enters as the operator of a robot, and drives until it is told to stop. */
export async function driver(base, robot, token) {
  const entered = await fetch(`${base}/operate/enter`, { method: "POST", headers: { authorization: `Bearer ${token}`, "content-type": "application/json" }, body: "{}" });
  const cookie = entered.headers.get("set-cookie").split(";")[0];
  const socket = new WebSocket(`${base.replace("http", "ws")}/operate/drive?robots=${robot}`, { headers: { cookie } });
  const own = { robot, head: null, row: null, told: [], rows: 0, said: 0, move: {}, go: true };
  socket.on("message", (data, binary) => {
    if (!binary) own.told.push(JSON.parse(data.toString()));
    else if (own.head) [own.row, own.rows] = [rowOf(data), own.rows + 1];
    else own.begin(data);
  });
  // The scene's message ends with the row of the step that stands.
  own.begin = (data) => {
    own.head = headOf(data);
    own.row = rowOf(data.subarray(data.length - 4 * lengthOf(own.head)));
  };
  own.ended = new Promise((done) => { socket.on("close", done); });
  await new Promise((ready, failed) => { socket.once("message", ready); socket.on("error", failed); });
  own.saying = setInterval(() => {
    if (socket.readyState !== WebSocket.OPEN) return clearInterval(own.saying);
    socket.send(JSON.stringify({ move: own.move, go: own.go }));
    own.said += 1;
    return undefined;
  }, SAY_MS);
  own.poses = () => posesIn(own.head, own.row, robot);
  own.time = () => own.row[2];
  own.leave = () => { clearInterval(own.saying); socket.close(); };
  return own;
}

/** Watches an episode by the link's key; counts what comes. */
export async function watcher(base, episode, key) {
  const socket = new WebSocket(`${base.replace("http", "ws")}/watch/live?episode=${episode}`, { headers: { authorization: `Bearer ${key}` } });
  const own = { steps: 0, told: 0, bytes: 0, open: true };
  socket.on("message", (/** @type {Buffer} */ data, binary) => {
    own[binary ? "steps" : "told"] += 1;
    own.bytes += data.length;
  });
  socket.on("close", () => { own.open = false; });
  await new Promise((ready, failed) => { socket.on("open", ready); socket.on("error", failed); });
  own.leave = () => socket.close();
  return own;
}
