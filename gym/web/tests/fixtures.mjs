// The data of every browser test: address, people, gym and wall of the server that `gym/tests/web/test_gym_app.py` started.

import { readFileSync } from "node:fs";
import { test as base } from "@playwright/test";
import { watchErrors } from "./place.mjs";

export const test = base.extend({
  places: [
    async ({}, use) => use(JSON.parse(readFileSync(process.env.WALLTOPO_PLACES, "utf8"))),
    { scope: "worker" },
  ],
  // Why an element did not come is often in the console.
  errors: [
    async ({}, use, info) => {
      const log = watchErrors();
      await use(log);
      if (info.status !== info.expectedStatus && log.length) console.log(`errors of the pages:\n${log.join("\n")}`);
    },
    { auto: true },
  ],
});
