// The data of every browser test: address, people, gym and wall of the server that `gym/tests/web/test_gym_app.py` started.

import { readFileSync } from "node:fs";
import { test as base } from "@playwright/test";

export const test = base.extend({
  places: [
    async ({}, use) => use(JSON.parse(readFileSync(process.env.WALLTOPO_PLACES, "utf8"))),
    { scope: "worker" },
  ],
});
