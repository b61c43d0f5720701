import { defineConfig } from "@playwright/test";
import { LAUNCH } from "../../../../viewer/tests/browser.mjs";

// The server and its published wall are made by `gym/tests/web/test_gym_app_smoke.py`, which runs this.
export default defineConfig({
  testDir: ".",
  testMatch: "smoke.spec.mjs",
  outputDir: "../../../../build/gym-smoke-results",
  workers: 1,
  timeout: 300_000,
  reporter: "list",
  use: { launchOptions: LAUNCH },
});
