// A climber reports a hold, without reception too; a setter sees it on the wall, marks it done, and opens it again.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

/** The holds to check, as the server has them. */
function toCheck(page, gym) {
  return page.evaluate((slug) => fetch(`/api/v1/gyms/${slug}/hold-reports`, { cache: "no-store" }).then((answer) => answer.json()), gym);
}

test("a hold is reported, found on the wall, and done", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  const { page } = climber;
  await signIn(climber, places, places.judge);
  await climber.go(`/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(page);

  // A hold chosen in 3D, by the viewer's own function: where it is on the screen depends on the camera.
  const hold = await page.evaluate(() => {
    const wall = document.querySelector("wall-topo");
    const { id } = wall.holds.find(({ route }) => route);
    wall.selectHold(id);
    return id;
  });
  await page.getByText("Report this hold").click();
  await page.getByText("It spins").click();
  await page.getByLabel("Note (optional)").fill("by half a turn");
  await page.locator("details[open]").scrollIntoViewIfNeeded();
  assert.ok((await tooWide(page)) <= 0, "the report is wider than the phone");
  assert.deepEqual(await grave(page), []);
  await climber.shot("report-hold");
  await climber.context.setOffline(true);
  await page.getByRole("button", { name: "Report", exact: true }).click();
  await page.getByText("setters will see your report").waitFor();
  await climber.context.setOffline(false);

  const setter = await visit(browser, places);
  await signIn(setter, places, places.owner);
  for (const end = Date.now() + 90_000; Date.now() < end; await new Promise((resolve) => setTimeout(resolve, 300))) {
    if ((await toCheck(setter.page, places.gym)).length) break;
  }
  const [row] = await toCheck(setter.page, places.gym);
  assert.deepEqual([row.current_hold, row.people, row.reports[0].note], [hold, 1, "by half a turn"]);
  climber.expected(OFFLINE);
  await climber.close();

  await setter.go(`/g/${places.gym}/holds`);
  await setter.page.getByText("by half a turn").waitFor();
  assert.deepEqual(await grave(setter.page), []);
  await setter.page.getByRole("link", { name: row.wall_name }).last().click();
  await wallDrawn(setter.page);
  const reported = setter.page.getByRole("listitem").filter({ hasText: "by half a turn" }).first();
  await reported.getByRole("button", { name: "Show on the wall" }).click();
  await setter.page.waitForFunction((id) => document.querySelector("wall-topo").selectedHold === id, hold);
  assert.ok((await tooWide(setter.page)) <= 0, "the list is wider than the phone");
  await setter.shot("holds-to-check");
  await reported.getByRole("button", { name: "Done", exact: true }).click();
  await setter.page.getByText("No open reports.").waitFor();
  await reported.getByRole("button", { name: "Not done" }).click();
  await reported.getByRole("button", { name: "Done", exact: true }).click();
  await setter.page.getByText("No open reports.").waitFor();
  await setter.close();
});

test("a hold that turned is found on the wall, and done", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  const { page } = setter;
  await signIn(setter, places, places.owner);
  await setter.go(`/g/${places.gym}/w/${places.wall}/holds`);
  await wallDrawn(page);
  const turned = page.getByRole("listitem").filter({ hasText: "Turned 24° clockwise" });
  await turned.getByRole("button", { name: "Show on the wall" }).click();
  await page.waitForFunction(() => document.querySelector("wall-topo").selectedHold);
  await page.getByText("Moved by 2.1 cm").waitFor();
  await page.getByText("12 holds compared").waitFor();
  assert.ok((await tooWide(page)) <= 0, "the list is wider than the phone");
  assert.deepEqual(await grave(page), []);
  await page.getByText("Changed since the last scan").scrollIntoViewIfNeeded();
  await setter.shot("holds-changed");
  await turned.getByRole("button", { name: "Done", exact: true }).click();
  await turned.getByRole("button", { name: "Not done" }).click();
  await turned.getByRole("button", { name: "Done", exact: true }).waitFor();
  await setter.close();
});
