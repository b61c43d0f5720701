// The shortest way through the app: sign in, open a wall, pick a route, tick it.

import assert from "node:assert/strict";
import { test } from "../fixtures.mjs";
import { signIn, visit, wallDrawn } from "../place.mjs";

test("a climber opens a wall, picks a route and ticks it", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  const { page, go, close } = climber;
  await signIn(climber, places, places.member);
  await go(`/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(page);
  await page.getByRole("main").getByRole("link", { name: /Moon/ }).first().click();
  await page.getByRole("heading", { level: 2, name: /Moon/ }).waitFor();
  const stored = page.waitForResponse((answer) => answer.request().method() === "PUT" && answer.url().includes("/ascents/"));
  await page.getByRole("group", { name: "Log an ascent" }).getByRole("button", { name: "Top" }).click();
  await page.getByText("Top logged").waitFor();
  assert.equal((await stored).ok(), true);
  const { items } = await (await page.context().request.get(`${places.address}/api/v1/me/ascents`)).json();
  assert.deepEqual(items.map(({ kind }) => kind), ["top"]);
  await close();
});
