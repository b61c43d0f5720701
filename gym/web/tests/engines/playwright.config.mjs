import { defineConfig } from "@playwright/test";

// The server and its gym are made by `gym/tests/web/test_gym_engines.py`, which runs these. Playwright is the runner alone.
export default defineConfig({
  testDir: ".",
  testMatch: "*.spec.mjs",
  outputDir: "../../../../build/gym-engine-results",
  projects: ["chromium", "firefox", "webkit"].map((name) => ({ name, use: { engine: name } })),
  workers: 1,
  timeout: 180_000,
  retries: 1, // a check that needed its second try is listed as flaky
  reporter: "list",
});
