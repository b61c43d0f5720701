// What every browser test is given: the pages that `tests/publish/test_viewer_browser.py` made and serves.

import { readFileSync } from "node:fs";
import { test as base } from "@playwright/test";

export const test = base.extend({
  places: [
    async ({}, use) => use(JSON.parse(readFileSync(process.env.WALLTOPO_PLACES, "utf8"))),
    { scope: "worker" },
  ],
  // On pages that are broken on purpose (SABOTAGE in browser.mjs) a test passes by failing.
  sabotage: [
    async ({}, use, info) => {
      if (process.env.WALLTOPO_SABOTAGE) info.fail();
      await use();
    },
    { auto: true },
  ],
});
