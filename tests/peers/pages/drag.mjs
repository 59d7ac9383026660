// Time on the page at /operate from a drag to a moving wrist, in real time with two robots: to the row with the motion, to its
// picture, and to the motion of the handle. It is measured on this machine, and over a connection with a delay of 100 ms each way.
// shared/browser.mjs describes how to run it. The machine has to be idle.
import assert from "node:assert/strict";
import { once } from "node:events";
import { connect, createServer } from "node:net";
import { PATIENCE_MS, countDrawn, done, drawnRate, median, open, post, serve } from "./shared/browser.mjs";
import { hear, places } from "./shared/rows.mjs";
import { driver } from "./shared/socket.mjs";

/** Maximum time from a drag to a picture of the moved wrist. */
const MOST_LATENCY_MS = 120;
/** Delay of the slow connection each way. */
const SLOW_LINK_MS = 100;

const { base } = await serve();
const started = await post(base, "/v1/episodes", { task: "handover", seed: 2000, operators: "per_robot", patience_s: 600, talk: true });
const [a, b] = started.operators;
const linkTo = (operator) => `/operate#${new URLSearchParams({ episode: started.episode_id, ...operator })}`;

/** Measures moves of the pointer and the places of a page's own right wrist. */
function watchPointer() {
  window.moves = [];
  addEventListener("pointermove", (event) => window.moves.push(event.timeStamp), true);
}

const person = (origin = base, link = linkTo(a)) => open(origin + link, { before: [hear, watchPointer, countDrawn] });
const running = (page) => page.getByRole("status").filter({ hasText: "Running" }).waitFor({ timeout: PATIENCE_MS });

/** Returns the medians of the times from drags of a person's right handle to the row with the moved wrist, to its picture, and to the handle. */
async function latencies(page, drags) {
  const found = [];
  // From this camera the wrist is always visible.
  await page.getByLabel("View").selectOption("free");
  await page.waitForTimeout(500);
  const at = places(await page.evaluate(() => window.head), await page.evaluate(() => window.head.robot));
  for (let drag = 0; drag < drags; drag += 1) {
    const box = await page.getByRole("button", { name: "right wrist: drag" }).boundingBox();
    const [u, v] = [box.x + box.width / 2, box.y + box.height / 2];
    await page.mouse.move(u, v);
    await page.mouse.down();
    await page.evaluate(({ right, pelvis }) => {
      const wrist = ({ row }) => [0, 1, 2].map((axis) => row[right + axis] - row[pelvis + axis]);
      const before = wrist(window.rows.at(-1));
      window.moves.length = 0;
      const own = /** @type {HTMLElement} */ (document.querySelector(".handle.right"));
      const place = own.style.transform;
      window.measured = new Promise((done, failed) => {
        let handleMs = null;
        setTimeout(() => failed(new Error("nothing has moved for ten seconds")), 10_000);
        const look = () => {
          const [begun] = window.moves;
          if (begun && handleMs === null && own.style.transform !== place) handleMs = performance.now() - begun;
          const moved = begun && window.rows.find((row) => row.came > begun && row.drawn && Math.hypot(...wrist(row).map((value, axis) => value - before[axis])) > 0.003);
          if (moved && handleMs !== null) done({ rowMs: moved.came - begun, drawnMs: moved.drawn - begun, handleMs });
          else requestAnimationFrame(look);
        };
        look();
      });
    }, at);
    // The drags go forth and back, so that the wrist stays within reach.
    await page.mouse.move(u + (drag % 2 ? 30 : -30), v);
    found.push(await page.evaluate(() => window.measured));
    await page.mouse.up();
    await page.waitForTimeout(500);
  }
  const middle = (name) => median(found.map((one) => one[name]));
  return { rowMs: middle("rowMs"), drawnMs: middle("drawnMs"), handleMs: middle("handleMs") };
}
const told = (where, { rowMs, drawnMs, handleMs }) => console.log(`${where}: from a drag to the row with the wrist moved ${rowMs.toFixed(0)} ms, to its picture ${drawnMs.toFixed(0)} ms, to the handle ${handleMs.toFixed(0)} ms (medians)`);

// B's person is at another machine, so its browser does not use this processor.
const other = await driver(base, "B", b.token);
const pageA = await person();
await running(pageA);
const time = (page) => page.evaluate(() => window.rows.at(-1).row[2]);
const [clock, simulated] = [performance.now(), await time(pageA)];
const quick = await latencies(pageA, 15);
told("on this machine", quick);
console.log(`the world ran at ${((await time(pageA) - simulated) / ((performance.now() - clock) / 1000)).toFixed(2)} of real time; A's page drew ${(await drawnRate(pageA)).toFixed(0)} frames a second`);

// B's person is at the same machine, in the same browser: one processor draws both pages.
other.leave();
const pageB = await person(base, linkTo(b));
await Promise.all([running(pageA), running(pageB)]);
const shared = await latencies(pageA, 11);
told("with B's page in the same browser", shared);
console.log(`A's page drew ${(await drawnRate(pageA)).toFixed(0)} frames a second, B's ${(await drawnRate(pageB)).toFixed(0)}`);
await pageB.context().close();
const again = await driver(base, "B", b.token);

// Over a connection with a delay of 100 ms each way, the handle follows the pointer immediately, and the wrist later.
const slow = createServer((near) => {
  const far = connect(Number(new URL(base).port), "127.0.0.1");
  const pass = (from, to) => from.on("data", (data) => setTimeout(() => to.writable && to.write(data), SLOW_LINK_MS)).on("close", () => setTimeout(() => to.end(), SLOW_LINK_MS)).on("error", () => to.destroy());
  pass(near, far);
  pass(far, near);
});
slow.listen(0, "127.0.0.1");
await once(slow, "listening");
const { port } = /** @type {import("node:net").AddressInfo} */ (slow.address());
await pageA.context().close();
const slowA = await person(`http://127.0.0.1:${port}`);
await running(slowA);
const late = await latencies(slowA, 7);
told(`over ${SLOW_LINK_MS} ms each way`, late);

// After a drag of a second the handle is at the pointer, and the wrist arrives.
const handle = slowA.getByRole("button", { name: "right wrist: drag" });
const before = await handle.boundingBox();
const [u, v] = [before.x + before.width / 2, before.y + before.height / 2];
await slowA.mouse.move(u, v);
await slowA.mouse.down();
for (let step = 1; step <= 20; step += 1) {
  await slowA.mouse.move(u - 4 * step, v - 2 * step);
  await slowA.waitForTimeout(50);
}
const after = await handle.boundingBox();
await slowA.mouse.up();
const off = Math.hypot(after.x - before.x + 80, after.y - before.y + 40);
console.log(`after a drag of a second over the slow link the handle is ${off.toFixed(0)} pixels from the pointer`);
again.leave();
slow.close();
assert.ok(late.rowMs > 2 * SLOW_LINK_MS && late.handleMs < MOST_LATENCY_MS && off < 25, JSON.stringify({ late, off }));
assert.ok(quick.drawnMs < MOST_LATENCY_MS && shared.drawnMs < MOST_LATENCY_MS, `${quick.drawnMs} and ${shared.drawnMs} ms`);
await done();
