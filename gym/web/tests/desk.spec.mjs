// A reset day: planned, forerun on a phone, and signed off.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, signIn, tooWide, visit } from "./place.mjs";

async function check(person, name) {
  await person.page.waitForFunction(() => !document.querySelector("main [role=status].quiet"));
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.page.evaluate(() => scrollTo(0, 0));
  await person.shot(name);
}

/** Propose a grade and marks for the open route of a forerunner's page. */
async function propose(page, route, grade, marks, note) {
  const panel = page.getByRole("listitem").filter({ hasText: route });
  await panel.getByText(route).click();
  await panel.getByLabel("Your grade").selectOption({ label: grade });
  for (const [mark, value] of Object.entries(marks)) {
    await panel.getByRole("group", { name: mark }).getByRole("button", { name: String(value) }).click();
  }
  if (note) await panel.getByLabel("Note (optional)").fill(note);
  return panel;
}

test("a reset day is planned, forerun and signed off", async ({ browser, places }) => {
  const begun = Date.now();
  const setter = await visit(browser, places);
  await signIn(setter, places, places.bare.setter);
  const { page } = setter;
  const api = `${places.address}/api/v1/gyms/${places.bare.gym}`;
  const headers = { origin: places.address };
  assert.equal((await page.request.post(`${api}/walls`, { data: { name: "Prow" }, headers })).status(), 201);
  const [{ id: system, grades }] = await (await page.request.get(`${api}/grade-systems`)).json();
  const hardest = grades.at(-1).label;
  const cells = [{ system, grade: hardest, routes: 4 }];
  assert.equal((await page.request.put(`${api}/insights/targets`, { data: { cells }, headers })).status(), 200);

  // The setter plans the day, and names a member as forerunner.
  await setter.go(`/g/${places.bare.gym}/settings`);
  await page.getByRole("link", { name: "Resets" }).click();
  await page.getByText("No reset is planned.").waitFor();
  await page.getByRole("button", { name: "Plan a reset" }).click();
  await page.getByLabel(/^\s*Wall\b/).selectOption({ label: "Prow" });
  await page.getByText("what your grade targets lack").waitFor();
  const suggested = page.getByLabel(`Wished routes in ${hardest}`, { exact: true });
  assert.equal(await suggested.inputValue(), "4");
  await suggested.fill("");
  await page.getByRole("checkbox", { name: "setter" }).check();
  await page.getByLabel("Find a member").fill("memb");
  await page.getByRole("button", { name: "Add member" }).click();
  await page.getByRole("button", { name: "Remove member" }).waitFor();
  await page.getByLabel("Wished routes in 6A", { exact: true }).fill("2");
  await page.getByLabel("Wished routes in 6B", { exact: true }).fill("1");
  await page.getByLabel("Note (optional)").fill("Keep the volumes");
  await check(setter, "reset-plan");
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByRole("heading", { name: "Reset of Prow" }).waitFor();
  const plan = new URL(page.url()).pathname;

  // Two routes are set.
  await page.getByRole("link", { name: "Add routes" }).click();
  const added = page.getByRole("list", { name: "Added routes" });
  for (const [name, colour] of [["Comet", "blue"], ["Meteor", "red"]]) {
    await page.getByLabel("Name", { exact: true }).fill(name);
    await page.locator("[data-field=colour]").selectOption(colour);
    await page.getByLabel("Setter").fill("Jana");
    await page.getByLabel("Setter").press("Enter");
    await added.getByRole("link", { name }).waitFor();
  }
  await setter.go(plan);
  await page.getByLabel("State").selectOption({ label: "Set" });
  await page.getByText("Saved.").waitFor();
  await page.getByRole("row", { name: /No grade 2/ }).waitFor();

  // A forerunner climbs on a phone, and changes their mind.
  const forerunner = await visit(browser, places);
  await signIn(forerunner, places, places.bare.member);
  await forerunner.go(`/g/${places.bare.gym}/desk`);
  await forerunner.page.getByRole("link", { name: "Prow" }).click();
  await forerunner.page.getByText("Keep the volumes").waitFor();
  await propose(forerunner.page, "Comet", "6A", { Risk: 2, Intensity: 3, Complexity: 4 }, "The last move is far.");
  await check(forerunner, "forerun");
  await forerunner.page.getByRole("button", { name: "Save proposal" }).click();
  await forerunner.page.getByText("✓ 6A").waitFor();
  const panel = await propose(forerunner.page, "Comet", "6B", { Risk: 2 });
  assert.equal(await panel.getByRole("button", { name: "2" }).first().getAttribute("aria-pressed"), "false");
  await panel.getByRole("button", { name: "Save proposal" }).click();
  await forerunner.page.getByText("✓ 6B").waitFor();
  await check(forerunner, "forerun-done");
  await forerunner.close();

  // The setter foreruns too, sees both proposals, and signs off.
  await setter.go(`${plan}/forerun`);
  const own = await propose(page, "Comet", "6B", { Risk: 4 });
  await own.getByRole("button", { name: "Save proposal" }).click();
  await page.getByText("✓ 6B").waitFor();
  await setter.go(plan);
  const comet = page.getByRole("region", { name: "Comet" });
  await comet.getByText("Proposals: 2").click();
  await comet.getByText("The last move is far.").waitFor();
  await comet.getByRole("button", { name: "Sign off" }).click();
  await comet.getByText("6B, signed off by setter").waitFor();
  await page.getByRole("row", { name: /6B 1 1/ }).waitFor();
  await page.getByLabel("State").selectOption({ label: "Tested" });
  await page.getByText("Saved.").waitFor();
  await check(setter, "reset-desk");
  await comet.scrollIntoViewIfNeeded();
  await setter.shot("reset-desk-route");
  await page.getByLabel("State").selectOption({ label: "Published" });
  await page.getByText("The wall was published on").waitFor();
  await setter.go(`/g/${places.bare.gym}/desk`);
  await page.getByText("Routes: 2 of 3, signed off: 1").waitFor();
  await check(setter, "resets");
  console.log(`a reset day: ${((Date.now() - begun) / 1000).toFixed(1)} s`);
  await setter.close();
});
