// What setters do after a reset. How long it takes is measured by `reset.mjs`: on a busy machine that says nothing.

import { test } from "./fixtures.mjs";
import { reset } from "./reset.mjs";

test("five tasks after a reset are done by taps", async ({ browser, places: { reset: on } }) => {
  await reset(browser, on.address, on.missed);
});
