import { defineConfig } from "@playwright/test";
import { LAUNCH } from "../../viewer/tests/browser.mjs";

// `gym/tests/web/test_gym_app.py` makes a server with a gym for each file and runs it.
export default defineConfig({
  testDir: "tests",
  testMatch: "*.spec.mjs",
  workers: 1,
  timeout: 900_000,
  reporter: "list",
  use: { launchOptions: LAUNCH, screenshot: "only-on-failure" },
});
