// What a page that drives hears over its socket: the scene, then a row of numbers a step. `gateway/web/src/message.js` says what is in a row.

/** Runs in a page before it: keeps the scene's head as `window.head`, and the rows as `window.rows`, with when they came and were drawn. */
export function hear() {
  window.rows = [];
  window.WebSocket = class extends WebSocket {
    constructor(url, protocols = []) {
      super(url, protocols);
      let told = false;
      this.addEventListener("message", ({ data }) => {
        if (typeof data === "string") return;
        if (!told) {
          told = true;
          window.head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, new DataView(data).getUint32(0, true))));
          return;
        }
        const own = { came: performance.now(), row: new Float32Array(data), drawn: null };
        window.rows.push(own);
        requestAnimationFrame(() => requestAnimationFrame((now) => { own.drawn = now; }));
        if (window.rows.length > 500) window.rows.shift();
      });
    }
  };
}

/** Where in a row the numbers of the robot `name` are. */
export function places(head, name) {
  const robot = head.robots.findIndex((one) => one.name === name);
  const links = head.robots.map((one) => 7 * one.links);
  const sum = (values) => values.reduce((total, one) => total + one, 0);
  const objects = 5 + sum(links);
  const parts = head.robots.map(({ joints }) => 1 + 7 + 4 + 46 + joints.length);
  const hands = objects + 7 * head.objects.length + sum(parts.slice(0, robot)) + 12;
  return { pelvis: 5 + sum(links.slice(0, robot)), objects, left: hands, right: hands + 23 };
}

/** How many numbers a row has. */
export function lengthOf({ robots, objects }) {
  return 5 + 7 * objects.length + robots.reduce((sum, { links, joints }) => sum + 7 * links + 1 + 7 + 4 + 46 + joints.length, 0);
}

/** @param {number[]} one @param {number[]} other */
const times = ([a, b, c, d], [e, f, g, h]) => [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
const turned = (q, [x, y, z]) => times(times(q, [0, x, y, z]), [q[0], -q[1], -q[2], -q[3]]).slice(1);

/**
 * Poses in a robot's pelvis frame of its wrists and of all objects, and the force on what its right hand touches, as a row has them;
 * quaternions are w, x, y, z.
 */
export function posesIn(head, row, name = head.robot) {
  const at = places(head, name);
  const read = (place) => ({ position: [...row.slice(place, place + 3)], turn: [row[place + 6], row[place + 3], row[place + 4], row[place + 5]] });
  const pelvis = read(at.pelvis);
  const back = [pelvis.turn[0], ...pelvis.turn.slice(1).map((value) => -value)];
  const local = ({ position, turn }) => ({ position: turned(back, position.map((value, axis) => value - pelvis.position[axis])), turn: times(back, turn) });
  const objects = Object.fromEntries(head.objects.map((object, index) => [object, local(read(at.objects + 7 * index))]));
  return {
    pelvis, left: local(read(at.left)), right: local(read(at.right)), objects, time_s: row[2],
    contact_n: Math.hypot(...row.slice(at.right + 20, at.right + 23)),
  };
}

/** The same of the newest row that a page has heard. */
export async function poses(page) {
  const { head, row } = await page.evaluate(() => ({ head: window.head, row: [...window.rows.at(-1).row] }));
  return posesIn(head, row);
}

export const apart = (one, other) => Math.hypot(...one.map((value, axis) => value - other[axis]));

/** `posesIn` for scripts that run in a page. */
export const inPages = {
  content: `${[lengthOf, places, posesIn].join("\n")}\nconst times = ${times}; const turned = ${turned}; window.posesIn = posesIn;`,
};
