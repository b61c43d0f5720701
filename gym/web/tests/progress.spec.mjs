// Counted ascents: sessions, progress, board, friends.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "./fixtures.mjs";
import { grave, signIn, tooWide, visit } from "./place.mjs";

/** Log an ascent of a current route, as the app does. */
async function tick(page, places, number, words) {
  const status = await page.evaluate(async ({ gym, wall, number, words }) => {
    const { routes } = await (await fetch(`/api/v1/gyms/${gym}/walls/${wall}/published`)).json();
    const body = { route_id: routes[number % routes.length].id, kind: "top", tries: 2, climbed_at: new Date().toISOString(), ...words };
    const init = { method: "PUT", headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
    return (await fetch(`/api/v1/gyms/${gym}/ascents/${crypto.randomUUID()}`, init)).status;
  }, { ...places, number, words });
  assert.equal(status, 201);
}

/** No serious axe finding and no horizontal overflow, at twice the text size too. */
async function fits(somebody, name) {
  const { page } = somebody;
  await page.waitForFunction(() => !document.querySelector("main [role=status].quiet"));
  assert.deepEqual(await grave(page), [], name);
  await page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
  const wide = await tooWide(page);
  assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
  await page.evaluate(() => document.documentElement.style.removeProperty("font-size"));
  await page.screenshot({ path: `${somebody.shots}/${name}.png`, fullPage: true });
}

test("a session by hand, its rest, its picture, and progress", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  climber.shots = places.shots;
  const { page } = climber;
  await signIn(climber, places, places.member);
  await climber.go(`/g/${places.gym}/progress`);
  await page.getByRole("button", { name: "Start session" }).click();
  await page.getByText("No sessions yet.").waitFor();
  await page.clock.setFixedTime(Date.now()); // else the minute can be over before anybody looks
  await page.getByRole("button", { name: "1 min" }).click();
  await page.getByRole("timer").waitFor();
  await page.reload(); // a closed tab keeps the rest timer
  await page.getByRole("timer").waitFor();
  await page.getByRole("button", { name: "Stop" }).click();
  await page.clock.resume();
  await tick(page, places, 0, { kind: "flash", tries: 1 });
  await tick(page, places, 1, {});
  await page.reload();
  await page.locator("main ol li").nth(1).waitFor();
  await fits(climber, "session-phone");
  const arrives = page.waitForEvent("download");
  await page.getByRole("button", { name: "Share a picture" }).click();
  const file = await (await arrives).path();
  assert.equal(readFileSync(file).subarray(1, 4).toString(), "PNG");
  await (await arrives).saveAs(`${places.shots}/session-picture.png`);
  await page.getByRole("button", { name: "End session" }).click();
  await page.getByRole("button", { name: "End session" }).waitFor({ state: "detached" });

  await page.getByRole("navigation").getByRole("link", { name: "Progress" }).click();
  await page.getByRole("heading", { name: "Routes by grade" }).waitFor();
  // A chart is a table to screen readers.
  await page.getByText("Show as table").first().click();
  await page.getByRole("table", { name: "Tops by week" }).waitFor();
  await fits(climber, "progress-phone");
  const csv = await page.evaluate(async () => (await fetch(document.querySelector('a[href*="grades.csv"]').href)).text());
  assert.match(csv, /^grade,worth,routes,flashes\n/);
  await climber.close();
});

test("the board names who wants it, and friends are asked", async ({ browser, places }) => {
  const climber = await visit(browser, places, { dark: true });
  climber.shots = places.shots;
  const { page } = climber;
  await signIn(climber, places, places.judge);
  await climber.go(`/g/${places.gym}/board`);
  await page.getByText("You are hidden").waitFor();
  await page.getByRole("link", { name: "Change in profile" }).click();
  await page.getByLabel("Show me on leaderboards").check();
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByText("Saved.").waitFor();
  await climber.go(`/g/${places.gym}/progress`);
  await tick(page, places, 0, {});
  await page.getByRole("navigation").getByRole("link", { name: "Board" }).click();
  await page.locator("tr[aria-current=true]").waitFor();
  await fits(climber, "board-dark-phone");
  const own = await page.locator("tr[aria-current=true] a").getAttribute("href");

  const friend = await visit(browser, places);
  friend.shots = places.shots;
  await signIn(friend, places, places.setter);
  await friend.go(own);
  await friend.page.getByRole("button", { name: "Follow" }).click();
  await friend.page.getByRole("button", { name: "Cancel request" }).waitFor();

  await climber.go(`/g/${places.gym}/feed`);
  await page.getByText("Follow requests").waitFor();
  await page.getByRole("button", { name: "Accept" }).click();
  await page.getByRole("heading", { name: "Followers" }).waitFor();
  await page.evaluate(() => fetch("/api/v1/me/profile", {
    method: "PUT", headers: { "content-type": "application/json" },
    body: JSON.stringify({ on_boards: true, show_ascents: "followers" }),
  }));
  await friend.go(`/g/${places.gym}/feed`);
  await friend.page.getByText("judge").first().waitFor();
  await fits(friend, "feed-phone");
  await friend.page.getByRole("button", { name: "Turn the feed off" }).click();
  await friend.page.getByText("The feed is off.").waitFor();
  await friend.close();
  await climber.close();
});
