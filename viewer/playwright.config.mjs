import { defineConfig } from "@playwright/test";
import { LAUNCH, PATIENCE_MS } from "./tests/browser.mjs";

// The pages are made and served by `tests/publish/test_viewer_browser.py`, which runs this.
export default defineConfig({
  testDir: "tests",
  testMatch: "*.spec.mjs",
  workers: 1,
  timeout: 600_000,
  reporter: "list",
  use: { launchOptions: LAUNCH, actionTimeout: PATIENCE_MS, navigationTimeout: PATIENCE_MS },
});
