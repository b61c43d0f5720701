// The screen in the hall, paper, tags, and embedded parts.

import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, visit, wallDrawn } from "./place.mjs";

const TURNS = 200;

/** A browser that fills a screen. */
async function screen(browser, places, width, height, motion = "reduce") {
  const seen = await visit(browser, places, { phone: false });
  await seen.page.setViewportSize({ width, height });
  await seen.page.emulateMedia({ reducedMotion: motion });
  return seen;
}

test("the hall's settings, on paper and on a website", async ({ browser, places }) => {
  const owner = await visit(browser, places);
  const { page } = owner;
  await signIn(owner, places, places.owner);
  await owner.go(`/g/${places.gym}/settings`);
  await page.getByRole("link", { name: "Screen and print" }).click();
  await page.getByLabel("Seconds per slide").fill("5");
  await page.getByLabel("Show this month’s leaderboard publicly").check();
  assert.deepEqual(await grave(page), []);
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByText("Saved.").waitFor();
  await owner.shot("hall-settings");
  await page.getByRole("link", { name: "Posters and cards" }).click();
  for (const [place, file] of [[0, /\.pdf/], [1, /cards-a7\.pdf/]]) {
    if (place) await page.getByLabel("Card size").selectOption("a7");
    await page.getByRole("button", { name: "Create PDF" }).nth(place).click();
    const saved = page.getByRole("link", { name: file }).last();
    await saved.waitFor();
    const coming = page.waitForEvent("download");
    await saved.click();
    assert.match((await coming).suggestedFilename(), file);
  }
  assert.deepEqual(await grave(page), []);
  await owner.shot("hall-paper");

  // A tag's address leads to its route.
  await owner.go(`/g/${places.gym}/settings/hall/tags`);
  await page.locator("main code").first().waitFor();
  assert.deepEqual(await grave(page), []);
  await owner.shot("hall-tags");
  await page.goto(await page.locator("main code").first().textContent());
  await page.waitForURL(/\/r\/[0-9a-f-]{36}$/);

  await owner.go(`/g/${places.gym}/settings/hall/website`);
  const frame = page.frameLocator("iframe");
  await frame.getByRole("heading", { name: "New routes" }).waitFor();
  assert.deepEqual(await grave(page), []);
  await owner.shot("hall-website");
  await page.getByLabel("Content").selectOption("board");
  await frame.getByRole("heading", { name: "Leaderboard of the month" }).waitFor();
  assert.match(await page.getByLabel("Embed code").inputValue(), /^<iframe src="http.*\/board" title="Leaderboard of the month"/);
  await owner.close();
});

test("the week's summary is offered once; messages end by a mail's link, signed in nowhere, and come back", async ({ browser, places }) => {
  const member = await visit(browser, places);
  await signIn(member, places, places.member);
  await member.go(`/g/${places.gym}`);
  await member.page.getByRole("heading", { name: "New routes, once a week?" }).waitFor();
  assert.deepEqual(await grave(member.page), []);
  await member.shot("ask-digest");
  await member.page.getByRole("button", { name: "By email" }).click();
  await member.page.getByRole("heading", { name: "New routes, once a week?" }).waitFor({ state: "detached" });
  await member.go("/me/messages");
  const weekly = "Weekly summary: new routes in my gyms, and my projects that leave soon";
  assert.ok(await member.page.getByLabel("By email").isChecked());
  await member.page.getByLabel("New routes in my gyms", { exact: true }).check();
  await member.page.getByRole("button", { name: "Save" }).click();
  await member.page.getByText("Saved.").waitFor();

  const reader = await visit(browser, places, { dark: true });
  const { page } = reader;
  await reader.go(`/unsubscribe#${places.mails_link}`);
  await page.getByRole("listitem").filter({ hasText: weekly }).waitFor();
  await page.getByRole("button", { name: "Stop weekly summary" }).click();
  await page.getByText("Done.").waitFor();
  assert.equal(await page.getByRole("listitem").filter({ hasText: weekly }).count(), 0);
  assert.deepEqual(await grave(page), []);
  await reader.shot("unsubscribe");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByRole("listitem").filter({ hasText: weekly }).waitFor();
  await page.getByRole("button", { name: "Stop push notifications" }).click();
  await page.getByRole("button", { name: "Stop weekly summary" }).click();
  await page.getByText("You receive no messages from us.").waitFor();
  await reader.close();

  await member.go("/me/messages");
  assert.ok(await member.page.getByLabel("Off").isChecked());
  await member.close();
});

test("the screen in the hall, upright and across, and without the server", async ({ browser, places }) => {
  for (const [name, width, height] of [["across", 1920, 1080], ["upright", 1080, 1920]]) {
    const seen = await screen(browser, places, width, height);
    await seen.go(`/kiosk/g/${places.gym}`);
    await wallDrawn(seen.page);
    await seen.page.locator("[data-slide]").waitFor();
    assert.deepEqual(await grave(seen.page), []);
    const wide = await seen.page.evaluate(() => [document.documentElement.scrollWidth - innerWidth, document.documentElement.scrollHeight - innerHeight]);
    assert.ok(Math.max(...wide) <= 0, `${name}: ${wide} pixels too large`);
    await seen.page.screenshot({ path: join(places.shots, `hall-screen-${name}.png`) });
    if (name === "across") {
      await seen.page.evaluate(() => navigator.serviceWorker.ready.then(() => undefined));
      await seen.page.reload(); // with the service worker, which stores what loads now
      await seen.page.locator("[data-slide]").waitFor();
      await seen.context.setOffline(true);
      await seen.page.reload();
      await seen.page.locator("[data-slide]").waitFor();
      seen.expected(OFFLINE);
    }
    await seen.close();
  }
});

test("a screen of days is as large as one of minutes", async ({ browser, places }) => {
  const seen = await screen(browser, places, 320, 200, "no-preference");
  const { page } = seen;
  // The test owns the time: each turn is one step of the clock.
  await page.clock.install();
  await seen.go(`/kiosk/g/${places.gym}`);
  await wallDrawn(page);
  await page.locator("[data-slide]").waitFor();
  const devtools = await seen.context.newCDPSession(page);
  const size = async () => {
    await devtools.send("HeapProfiler.collectGarbage");
    const { usedSize } = await devtools.send("Runtime.getHeapUsage");
    const { nodes, jsEventListeners } = await devtools.send("Memory.getDOMCounters");
    return { heap: usedSize, nodes, jsEventListeners };
  };
  const seconds = await page.evaluate((gym) => fetch(`/api/v1/gyms/${gym}/screen`).then((r) => r.json()).then((f) => f.seconds), places.gym);
  for (let turn = 0; turn < 10; turn++) await page.clock.fastForward(seconds * 1000);
  const before = await size();
  for (let turn = 0; turn < TURNS; turn++) await page.clock.fastForward(seconds * 1000);
  const after = await size();
  assert.ok(after.nodes <= before.nodes + 50, `nodes: ${before.nodes}, then ${after.nodes}`);
  assert.ok(after.jsEventListeners <= before.jsEventListeners + 20, `listeners: ${before.jsEventListeners}, then ${after.jsEventListeners}`);
  assert.ok(after.heap < before.heap * 1.3 + 3e6, `bytes: ${before.heap}, then ${after.heap}`);
  assert.equal(await page.locator("wall-topo").count(), 1);
  await seen.close();
});
