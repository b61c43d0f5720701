// A figure climbs a published route: for one's height of the profile, else for the one entered on the phone.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

const PATIENCE_MS = 90_000;

/** The address of a route with moves, once the worker has computed them. */
async function routeWithMoves(page, { gym, wall }) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; await page.waitForTimeout(300)) {
    const version = await page.evaluate((path) => fetch(path, { cache: "no-store" }).then((answer) => answer.json()), `/api/v1/gyms/${gym}/walls/${wall}/published`);
    assert.notEqual(version.moves.state, "failed");
    if (version.moves.state === "waiting") continue;
    assert.ok("moves.json" in version.files);
    const route = version.routes.find(({ number }) => version.moves.routes.includes(number));
    assert.ok(route, "no route of the wall can be climbed");
    return `/g/${gym}/w/${wall}/r/${route.id}`;
  }
  throw new Error(`no moves after ${PATIENCE_MS / 1000} s`);
}

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

test("a route shows its moves for one's own body", async ({ browser, places }) => {
  const begun = Date.now();
  const climber = await visit(browser, places);
  const { page, go } = climber;
  await go(`/g/${places.gym}`);
  const address = await routeWithMoves(page, places);
  await go(address);
  await wallDrawn(page);
  // Without an account: an adult, until height and reach are entered; the phone keeps them.
  const show = page.getByRole("button", { name: "Suggested moves" });
  const shown = (height) => page.getByText(`For a body of ${height} m.`).waitFor();
  await show.click();
  await shown("1.75");
  await page.getByLabel("Height in cm").fill("158");
  await page.getByLabel("Reach in cm").press("Tab");
  await shown("1.55");
  const player = page.locator("wall-topo .player");
  for (let move = 0; move < 2; move++) await player.getByRole("button", { name: "Next move" }).click();
  await player.getByText(/^3\//).waitFor();
  assert.equal(await player.getByRole("combobox").inputValue(), "short");
  await page.getByText("For a body of").scrollIntoViewIfNeeded();
  await check(climber, "moves");
  // Another body in the viewer itself, then away.
  await player.getByRole("combobox").selectOption("tall");
  await shown("1.90");
  await player.getByRole("button", { name: "Close" }).click();
  await show.waitFor();
  await page.reload();
  await wallDrawn(page);
  await show.click();
  await shown("1.55");
  await page.getByRole("link", { name: "Next route" }).click();
  await player.waitFor({ state: "detached" });

  // With an account the profile counts, and nothing is asked.
  await signIn(climber, places, places.member);
  const status = await page.evaluate(async () => {
    const profile = await (await fetch("/api/v1/me/profile")).json();
    const body = JSON.stringify({ ...profile, height_cm: 186, reach_cm: 190 });
    return (await fetch("/api/v1/me/profile", { method: "PUT", headers: { "content-type": "application/json" }, body })).status;
  });
  assert.equal(status, 200);
  await go(address);
  await wallDrawn(page);
  await show.click();
  await shown("1.90");
  assert.equal(await page.getByLabel("Height in cm").count(), 0);
  await check(climber, "moves-profile");
  await climber.close();

  // Beside a list, and without reception at first.
  const laptop = await visit(browser, places, { phone: false });
  await laptop.go(address);
  await wallDrawn(laptop.page);
  await laptop.context.setOffline(true);
  await laptop.page.getByRole("button", { name: "Suggested moves" }).click();
  await laptop.page.getByText("The moves could not be loaded.").waitFor();
  await laptop.context.setOffline(false);
  await laptop.page.getByRole("button", { name: "Suggested moves" }).click();
  await laptop.page.getByText("For a body of 1.75 m.").waitFor();
  await laptop.page.locator("wall-topo .player").getByRole("button", { name: "Next move" }).click();
  await check(laptop, "moves");
  laptop.expected(OFFLINE);
  await laptop.close();
  console.log(`moves are shown in ${(Date.now() - begun) / 1000} s`);
});
