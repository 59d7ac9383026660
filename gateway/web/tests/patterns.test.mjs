// Patterns of surfaces: their numbers equal those of the server's renderers, and their means those of their functions: `npm test`.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { PATTERNS, PATTERN_NUMBERS } from "../src/stage/patterns.js";

test("the numbers are those of the server", () => {
  const source = readFileSync(new URL("../../../sim/src/render/shading/pattern.rs", import.meta.url), "utf8");
  const found = Object.fromEntries([...source.matchAll(/^(?:pub )?const (\w+): f32 = ([\d.]+);/gm)].map(([, name, value]) => [name, Number(value)]));
  assert.deepEqual(PATTERN_NUMBERS, found);
});

test("a mean is that of its pattern", () => {
  const names = [...Object.keys(PATTERN_NUMBERS), "wave", "floor", "pow", "mod", "float"];
  const wave = (value) => 1 - 2 * Math.abs(value - Math.round(value));
  const mod = (value, divisor) => value - divisor * Math.floor(value / divisor);
  const given = [...Object.values(PATTERN_NUMBERS), wave, Math.floor, Math.pow, mod, Number];
  for (const [name, { share, mean }] of Object.entries(PATTERNS)) {
    // The used part of GLSL is also valid JavaScript.
    const shareAt = new Function(...names, "p", `return ${share};`);
    let sum = 0;
    const count = 200_000;
    for (let point = 0; point < count; point += 1) {
      const [x, y, z] = [0.618034, 0.754878, 0.569840].map((step) => 7 * mod(step * point, 1));
      sum += shareAt(...given, { x, y, z });
    }
    assert.ok(Math.abs(sum / count - mean) < 0.01, `${name}: ${sum / count} and not ${mean}`);
  }
});
