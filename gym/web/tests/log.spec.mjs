// One log of all climbs: filters, corrections, climbs elsewhere, imports, the year; several ascents at once.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "./fixtures.mjs";
import { becomes, grave, signIn, tooWide, visit } from "./place.mjs";

const EXPORT = [
  "route_boulder,name,location_name,sector_name,area_name,country_code,date,type,sub_type,rating,project,tries,repeats,difficulty,perceived_hardness,comment,height,recommended,sits",
  "BOULDER,El Fuego,Petrohrad,Kaple,null,CZE,2024-03-02T00:00:00+00:00,rp,null,3,0,7,0,7A+,null,windy,0,0,1",
  "ROUTE,Silbergeier,Rätikon,Unknown Sector,null,CHE,2023-07-08T00:00:00+00:00,os,null,4,0,0,0,8b+,null,null,0,1,0",
  "ROUTE,Nowhere,Rätikon,,null,CHE,2023-07-08T00:00:00+00:00,swum,null,4,0,0,0,8b+,null,null,0,1,0",
].join("\n");

/** No serious axe finding and no horizontal overflow, at twice the text size too. */
async function fits(page, shots, name) {
  assert.deepEqual(await grave(page), [], name);
  await page.screenshot({ path: `${shots}/${name}.png`, fullPage: true });
  await page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
  const wide = await tooWide(page);
  assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
  await page.evaluate(() => document.documentElement.style.removeProperty("font-size"));
}

test("a log of this gym, of elsewhere and of another app", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  const { page } = climber;
  await signIn(climber, places, places.member);
  const status = await page.evaluate(async ({ gym, wall }) => {
    const { routes } = await (await fetch(`/api/v1/gyms/${gym}/walls/${wall}/published`)).json();
    const body = { route_id: routes[0].id, kind: "top", tries: 2, climbed_at: new Date().toISOString() };
    const init = { method: "PUT", headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
    return (await fetch(`/api/v1/gyms/${gym}/ascents/${crypto.randomUUID()}`, init)).status;
  }, places);
  assert.equal(status, 201);

  await climber.go("/me");
  await page.getByRole("link", { name: "My log" }).click();
  await page.getByRole("button", { name: "Add a climb" }).click();
  await page.getByLabel("Name of the climb").fill("Kauk");
  await page.getByLabel("Crag or area").fill("Frankenjura");
  await page.getByLabel("Grade", { exact: true }).first().fill("7b");
  await page.getByLabel("Style").selectOption("onsight");
  await fits(page, places.shots, "log-add-phone");
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByText("Kauk").waitFor();

  // A correction of the ascent in the gym, which counts there, too.
  const line = page.locator("li").filter({ hasText: "2 tries" });
  await line.getByRole("button", { name: /^Edit / }).click();
  await line.getByLabel("Result").selectOption("try");
  await line.getByLabel("Private note").fill("nearly");
  await line.getByRole("button", { name: "Save" }).click();
  await page.getByText("nearly").waitFor();
  await fits(page, places.shots, "log-phone");

  await page.getByLabel("Search name, note or place").fill("frank");
  await page.getByText("nearly").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Clear filters" }).click();
  // In the first hours of a month a gym's day still belongs to the month before, which is closed now.
  const closed = page.locator("details:not([open]) > summary h2");
  await page.getByText("nearly").or(closed).first().waitFor();
  for (const month of await closed.all()) await month.click();
  await page.getByText("nearly").waitFor();

  await page.getByRole("link", { name: "Import", exact: true }).click();
  const chosen = { name: "8a.csv", mimeType: "text/csv", buffer: Buffer.from(EXPORT) };
  await page.locator("input[type=file]").setInputFiles(chosen);
  await page.getByText("2 new climbs").waitFor();
  await page.getByText("The style 'swum' is unknown").waitFor();
  await fits(page, places.shots, "log-import-phone");
  await page.getByRole("button", { name: "Add 2 climbs" }).click();
  await page.getByText("2 climbs were added.").waitFor();
  await page.locator("input[type=file]").setInputFiles(chosen);
  await page.getByText("2 already in your log").waitFor();

  await climber.go("/me/log/year/2024");
  await page.getByRole("heading", { name: "Tops by month" }).waitFor();
  await fits(page, places.shots, "log-year-phone");
  const arrives = page.waitForEvent("download");
  await page.getByRole("button", { name: "Share a picture" }).click();
  const picture = await (await arrives).path();
  assert.equal(readFileSync(picture).subarray(1, 4).toString(), "PNG");
  await (await arrives).saveAs(`${places.shots}/log-year-picture.png`);

  // Deleted for good: a second import of the same file does not bring it back.
  await climber.go("/me/log");
  const month = page.locator("details").filter({ hasText: "March 2024" });
  await month.locator("summary").click();
  const imported = month.locator("li").filter({ hasText: "El Fuego" });
  await imported.getByRole("button", { name: "Edit El Fuego" }).click();
  await imported.getByRole("button", { name: "Delete" }).click();
  await imported.getByRole("dialog").getByRole("button", { name: "Delete" }).click();
  await month.waitFor({ state: "detached" });
  await climber.close();
});

test("several routes at once, and what is left", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  const { page } = climber;
  await signIn(climber, places, places.setter);
  await climber.go(`/g/${places.gym}`);
  const rows = page.locator(".routes li");
  await rows.first().waitFor();
  const all = await rows.count();
  await page.getByText(/routes? left$/).first().click();
  await fits(page, places.shots, "left-phone");

  await page.getByRole("button", { name: "Log several routes" }).click();
  await rows.nth(0).getByRole("button").first().click();
  // A long press asks for another result, and so does the button beside the route.
  const second = rows.nth(1).getByRole("button").first();
  await second.scrollIntoViewIfNeeded();
  const box = await second.boundingBox();
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  const dialog = page.getByRole("dialog", { name: /^Result of / });
  await dialog.waitFor();
  await page.mouse.up();
  await dialog.getByLabel("Try", { exact: true }).check();
  await dialog.getByLabel("Tries that day").fill("3");
  await fits(page, places.shots, "many-result-phone");
  await dialog.getByRole("button", { name: "Mark" }).click();
  await fits(page, places.shots, "many-phone");
  await page.getByRole("button", { name: "Log 2 ascents" }).click();
  await page.getByText("2 ascents logged.").waitFor();
  const logged = async () => page.evaluate(async (gym) => {
    const { ascents } = await (await fetch(`/api/v1/gyms/${gym}/logbook`, { cache: "no-store" })).json();
    return ascents.map(({ kind, tries }) => `${kind} ${tries}`).sort();
  }, places.gym);
  await becomes(logged, ["top 1", "try 3"]);
  await page.getByText(all === 2 ? "One route left" : `${all - 1} routes left`).waitFor();

  await page.getByRole("button", { name: "Undo" }).click();
  await becomes(logged, []);
  await climber.close();
});
