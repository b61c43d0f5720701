// A scan that still runs: its page shows what is known, and becomes the wall's own page.

import assert from "node:assert/strict";
import { ask, fine, open, settle, text } from "./browser.mjs";
import { test } from "./fixtures.mjs";

test("the page of a running scan follows it to the end", async ({ browser, places: { growing, shots } }) => {
  const { page, log, close } = await open(browser, growing, { width: 390, height: 844, phone: true });
  assert.equal(new URL(page.url()).pathname, "/first-look");
  await settle(page);
  assert.equal(await page.title(), "Growing wall");
  const list = await page.evaluate(() => {
    const part = document.querySelector("wall-topo").shadowRoot.querySelector("[part~=list]");
    return part.checkVisibility();
  });
  assert.equal(list, false, "no list of holds that nobody has found yet");
  await page.screenshot({ path: `${shots}/growing.png` });
  await page.waitForURL(growing, { timeout: 180_000 });
  await page.waitForFunction(() => document.querySelector("wall-topo")?.hasAttribute("data-ready"), null, { timeout: 180_000 });
  assert.ok((await ask(page, (wall) => wall.holds.length)) > 0);
  assert.match(await text(page, "h2"), /./);
  fine(log);
  await close();
});
