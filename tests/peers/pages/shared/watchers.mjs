// People who watch, on a thread of their own, so that who plays has its own to itself.
import { parentPort, workerData } from "node:worker_threads";
import { watcher } from "./socket.mjs";

const { base, episode, key, count } = workerData;
const watching = await Promise.all(Array.from({ length: count }, () => watcher(base, episode, key)));
parentPort.once("message", () => {
  parentPort.postMessage(watching.map(({ steps }) => steps));
  watching.forEach((one) => one.leave());
});
parentPort.postMessage("they watch");
