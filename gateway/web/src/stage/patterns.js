// Patterns of surfaces, which are functions of the point, like in the server's renderers: `sim/src/render/shading/pattern.rs`.

/** The numbers of the patterns, by their names there. */
export const PATTERN_NUMBERS = {
  WOOD_DARK: 0.7,
  FABRIC_DARK: 0.75,
  INK_DARK: 0.45,
  CHECKER_PER_M: 2,
  BANDS_PER_M: 13,
  LINES_PER_M: 41,
  STRAY: 0.4,
  THREADS_PER_M: 18,
  TEXT_PER_M: 48,
  TEXT_GAP: 0.55,
  WORDS_PER_M: 27,
  WORD_GAP: 0.3,
  WORD_STRAY: 0.37,
};

const NUMBERS = Object.entries(PATTERN_NUMBERS).map(([name, value]) => `const float ${name} = ${value.toFixed(4)};`).join("\n");

/**
 * All patterns except plain ones: the second colour as a share of the first, the share of the second at a point in GLSL, its mean, and the
 * finest period, below which the mean is drawn.
 * @type {Record<"checker" | "wood" | "fabric" | "print", { dark: number, share: string, mean: number, finestPerM: number }>}
 */
export const PATTERNS = {
  checker: {
    dark: 1,
    share: "float(mod(floor(p.x * CHECKER_PER_M) + floor(p.y * CHECKER_PER_M), 2.0) == 0.0)",
    mean: 0.5,
    finestPerM: PATTERN_NUMBERS.CHECKER_PER_M,
  },
  wood: {
    dark: PATTERN_NUMBERS.WOOD_DARK,
    share: `0.7 * pow(wave((p.y + p.z) * BANDS_PER_M + STRAY * wave(p.x * 1.1 + p.y + p.z)), 2.0)
      + 0.3 * wave((p.y + p.z) * LINES_PER_M + p.x)`,
    mean: 0.7 / 3 + 0.3 / 2,
    finestPerM: PATTERN_NUMBERS.LINES_PER_M,
  },
  fabric: {
    dark: PATTERN_NUMBERS.FABRIC_DARK,
    share: "wave((p.x + p.z) * THREADS_PER_M) * wave((p.y + p.z) * THREADS_PER_M)",
    mean: 0.25,
    finestPerM: PATTERN_NUMBERS.THREADS_PER_M,
  },
  print: {
    dark: PATTERN_NUMBERS.INK_DARK,
    share: `float(wave(p.z * TEXT_PER_M) > TEXT_GAP
      && wave((p.x + p.y) * WORDS_PER_M + WORD_STRAY * floor(p.z * TEXT_PER_M)) > WORD_GAP)`,
    mean: (1 - PATTERN_NUMBERS.TEXT_GAP) * (1 - PATTERN_NUMBERS.WORD_GAP),
    finestPerM: PATTERN_NUMBERS.TEXT_PER_M,
  },
};

/** Periods per pixel at which a pattern begins to fade to its mean, and at which only the mean is left. */
const FADES_PER_PIXEL = [0.3, 0.7];

/**
 * Returns GLSL for a function `patternShare` of a point `p`.
 * @param {keyof typeof PATTERNS} pattern
 */
export function patternGlsl(pattern) {
  const { share, mean, finestPerM } = PATTERNS[pattern];
  const [from, to] = FADES_PER_PIXEL.map((periods) => (periods / finestPerM).toFixed(5));
  return `${NUMBERS}
    float wave(float value) { return 1.0 - 2.0 * abs(value - round(value)); }
    float patternShare(vec3 p) {
      vec3 step_m = fwidth(p);
      float fine = ${share};
      return mix(fine, ${mean.toFixed(4)}, smoothstep(${from}, ${to}, max(step_m.x, max(step_m.y, step_m.z))));
    }`;
}
