// Lints of the pages and of the scripts in tests/peers/pages: ESLint's recommended rules and a few more, without rules for formatting.
import js from "@eslint/js";
import globals from "globals";

const RULES = { eqeqeq: "error", "no-implicit-coercion": "error", "no-var": "error", "prefer-const": "error" };

export default [
  { ignores: ["**/dist/", "**/target/"] },
  { ...js.configs.recommended, files: ["**/*.js", "**/*.mjs"] },
  { files: ["**/*.js"], languageOptions: { globals: globals.browser }, rules: RULES },
  { files: ["**/*.mjs"], languageOptions: { globals: globals.node }, rules: RULES },
  // Functions in these scripts run in pages.
  { files: ["tests/peers/pages/**"], languageOptions: { globals: globals.browser } },
];
