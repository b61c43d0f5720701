// Routes without a scan: added by hand and from a table, climbed, and placed by the first scan of the wall.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

test("routes before the first scan, and their places afterwards", async ({ browser, places }) => {
  const { gym, wall, scan, colour } = places.bare;
  const setter = await visit(browser, places);
  await signIn(setter, places, places.bare.setter);
  const { page } = setter;

  // One by hand, by keyboard; and one too many, which is taken back.
  await setter.go(`/g/${gym}/w/${wall}/versions`);
  await page.getByRole("link", { name: "Add routes" }).click();
  const added = page.getByRole("list", { name: "Added routes" });
  for (const name of ["Moon", "Mistake"]) {
    await page.getByLabel("Name", { exact: true }).fill(name);
    await page.locator("[data-field=colour]").selectOption(colour);
    await page.locator("[data-field=grade]").selectOption({ label: "6A" });
    await page.getByLabel("Setter").fill("Jana");
    await page.getByLabel("Setter").press("Enter");
    await added.getByRole("link", { name }).waitFor();
  }
  assert.ok(await page.getByLabel("Name", { exact: true }).evaluate((at) => at === document.activeElement));
  await check(setter, "add-routes");
  await added.getByRole("listitem").filter({ hasText: "Mistake" }).getByRole("button", { name: "Undo" }).click();
  await added.getByRole("link", { name: "Mistake" }).waitFor({ state: "detached" });

  // A table: first its errors, then what would be added, then the routes.
  const [template] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: "Download template" }).click()]);
  assert.equal(template.suggestedFilename(), "routes.csv");
  const pasted = page.getByLabel("Or paste it here");
  await pasted.fill("name;grade;colour\nSun;6B;jaune\nStar;99;blue\n");
  await page.getByRole("button", { name: "Check" }).click();
  await page.getByText("One error; nothing was added.").waitFor();
  await page.getByText("Line 3").waitFor();
  await page.getByText("One correct route").waitFor();
  await page.getByText("One correct route").scrollIntoViewIfNeeded();
  await check(setter, "add-routes-errors");
  // As a spreadsheet of Windows saves it.
  const buffer = Buffer.from("name;grade;colour\r\nÉtoile;6C;\r\nSun;6B;jaune\r\n", "latin1");
  await page.getByLabel("Choose a file").setInputFiles({ name: "routes.csv", mimeType: "text/csv", buffer });
  await page.getByRole("button", { name: "Check" }).click();
  await page.getByText("Étoile").last().waitFor();
  await page.getByRole("button", { name: "Add 2 routes" }).click();
  await page.getByText("2 routes were added.").waitFor();

  // Climbers have the list and the card, and log ascents.
  const climber = await visit(browser, places);
  await signIn(climber, places, places.bare.member);
  await climber.go(`/g/${gym}/w/${wall}`);
  await climber.page.getByText("No 3D view yet.").waitFor();
  await climber.page.locator("main li a").nth(2).waitFor();
  assert.equal(await climber.page.locator("main li a").count(), 3);
  assert.equal(await climber.page.locator("wall-topo").count(), 0);
  await check(climber, "wall-without-scan");
  await climber.page.locator("main li a", { hasText: "Moon" }).click();
  await climber.page.getByText("Not in the 3D view yet.").waitFor();
  await climber.page.getByRole("button", { name: "Top", exact: true }).click();
  await climber.page.getByText("Top logged.").waitFor();
  await check(climber, "route-without-scan");

  // Stripped by hand, and back.
  await setter.go(`/g/${gym}/w/${wall}/r/${(await climber.page.url()).split("/").at(-1)}`);
  await page.getByRole("button", { name: "Strip" }).click();
  await page.getByText("Stripped on").waitFor();
  assert.equal(await page.getByRole("button", { name: "Delete route" }).count(), 0);
  await page.getByRole("button", { name: "Put back on the wall" }).click();
  await page.getByText("Not in the 3D view yet.").waitFor();
  await setter.go(`/g/${gym}/w/${wall}/versions`);
  await page.getByRole("listitem").filter({ hasText: "Étoile" }).getByRole("button", { name: "Strip" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Strip" }).click();
  await page.getByText("Étoile is stripped.").waitFor();
  await check(setter, "strip-undo");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByRole("listitem").filter({ hasText: "Étoile" }).waitFor();

  // The scan in review: one of its routes is the one that was added by hand.
  await setter.go(`/g/${gym}/s/${scan}`);
  await wallDrawn(page);
  await page.getByRole("button", { name: "Is this Moon 6A?" }).click();
  await page.waitForFunction(() => [...document.querySelectorAll("[data-field=name]")].some(({ value }) => value === "Moon"));
  await page.getByText("2 routes added by hand stay").scrollIntoViewIfNeeded();
  await check(setter, "review-by-hand");
  await page.getByRole("button", { name: "Publish" }).click();
  await page.getByText("This version is published.").waitFor();
  await setter.close();

  await climber.page.reload();
  await wallDrawn(climber.page);
  await climber.page.getByRole("heading", { name: "Moon" }).waitFor();
  await climber.page.getByText("Holds", { exact: true }).waitFor();
  await climber.page.getByText("My ascents").waitFor();
  assert.equal(await climber.page.getByText("Not in the 3D view yet.").count(), 0);
  await climber.go(`/g/${gym}/w/${wall}`);
  await climber.page.locator("main li a", { hasText: "Étoile" }).click();
  await climber.page.getByText("Not in the 3D view yet.").waitFor();
  await climber.close();
});
