import { defineConfig } from "@playwright/test";
import { LAUNCH } from "../../viewer/tests/browser.mjs";

// One gym through one evening, in this order: what `publishing` publishes is climbed, judged and left by the others.
const EVENING = ["forms", "setting", "capture", "publishing", "progress", "insights", "climbing", "moves", "holds", "problems", "competitions", "account", "hall", "routes", "desk"];

// The server and its gym are made by `gym/tests/web/test_gym_app.py`, which runs this.
export default defineConfig({
  testDir: "tests",
  outputDir: "../../build/gym-results",
  projects: EVENING.map((name) => ({ name, testMatch: `${name}.spec.mjs` })),
  workers: 1,
  timeout: 900_000,
  retries: 1, // a check that needed its second try is listed as flaky
  reporter: "list",
  use: { launchOptions: LAUNCH, screenshot: "only-on-failure" },
});
