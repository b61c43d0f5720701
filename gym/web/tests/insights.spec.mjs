// Insights for setters and owners: each page by axe, at twice the text size, on a phone and a laptop.

import assert from "node:assert/strict";
import { settle } from "../../../viewer/tests/browser.mjs";
import { test } from "./fixtures.mjs";
import { grave, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

/** No serious axe finding and no horizontal overflow, at twice the text size too; in light and dark. */
async function fits(somebody, places, name) {
  const { page } = somebody;
  await page.waitForFunction(() => !document.querySelector("main [role=status].quiet"));
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    assert.deepEqual(await grave(page), [], `${name}, ${colorScheme}`);
  }
  await page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
  const wide = await tooWide(page);
  await page.screenshot({ path: `${places.shots}/${name}-large.png`, fullPage: true });
  assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
  await page.evaluate(() => document.documentElement.style.removeProperty("font-size"));
  await page.screenshot({ path: `${places.shots}/${name}.png`, fullPage: true });
}

/** How many pixels of the wall's picture are reddish, as the heat's ramp is, and how many greenish or bluish. */
async function hues(page) {
  return page.evaluate(async () => {
    const bitmap = await createImageBitmap(await document.querySelector("wall-topo").screenshot());
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    const context = canvas.getContext("2d");
    context.drawImage(bitmap, 0, 0);
    const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
    const found = { warm: 0, cold: 0 };
    for (let at = 0; at < data.length; at += 4) {
      const [red, green, blue] = [data[at], data[at + 1], data[at + 2]];
      if (red > green + 40 && red > blue + 20) found.warm++;
      if (green > red + 40 || blue > red + 40) found.cold++;
    }
    return found;
  });
}

test("a setter learns what hangs, wishes for grades, and takes it away", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  const { page } = setter;
  await signIn(setter, places, places.setter);
  await setter.go(`/g/${places.gym}/settings`);
  await page.getByRole("link", { name: "Insights" }).click();
  await page.getByRole("heading", { name: "What to strip next" }).waitFor();
  await page.getByRole("button", { name: "Edit targets" }).click();
  await page.getByLabel("Target for 6A", { exact: true }).fill("3");
  await page.getByLabel("Target for Slab").fill("2");
  await page.getByRole("button", { name: "Save" }).click();
  const wished = page.getByRole("table", { name: "Grades and targets" });
  await wished.getByRole("row", { name: /6A \d+ 3/ }).waitFor();
  await page.getByRole("table", { name: "Setters" }).or(page.getByText("No routes name a setter.")).first().waitFor();
  await fits(setter, places, "insights-phone");
  const csv = await page.evaluate(async () => (await fetch(document.querySelector('a[href*="routes.csv"]').href)).text());
  assert.match(csv, /^id,wall_id,number,name,/);
  await page.getByRole("navigation", { name: "Pages" }).getByRole("link", { name: "Styles" }).click();
  await page.getByRole("heading", { name: "Styles" }).waitFor();
  await fits(setter, places, "insights-styles-phone");
  await page.getByRole("link", { name: "Holds" }).click();
  await page.getByRole("heading", { name: "Washing" }).waitFor();
  await page.getByRole("button", { name: "Washed today" }).click();
  await page.getByText(/Washed on/).waitFor();
  await page.getByText("Import a table").click();
  await page.getByLabel(/One line for each colour/).fill("colour;type;number\nred;;60\nblue;;many");
  await page.getByRole("button", { name: "Import" }).click();
  await page.getByText("Line 3 is not colour, type, number.").waitFor();
  await page.getByLabel(/One line for each colour/).fill("colour;type;number\nred;;60");
  await page.getByRole("button", { name: "Import" }).click();
  await page.getByText("Saved.").waitFor();
  assert.equal(await page.getByLabel("Owned: Red, All types").inputValue(), "60");
  const counts = await page.locator("main td").allTextContents();
  assert.ok(counts.every((text) => !/^\d+[.,]\d+$/.test(text.trim())), `holds are whole: ${counts}`);
  await fits(setter, places, "insights-holds-phone");
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByText("Not washed yet").waitFor();
  await setter.close();
});

test("the wall shows where it is climbed", async ({ browser, places }) => {
  const setter = await visit(browser, places, { phone: false });
  const { page } = setter;
  await signIn(setter, places, places.setter);
  await setter.go(`/g/${places.gym}/insights`);
  await page.evaluate(async ({ gym, wall }) => {
    const { routes } = await (await fetch(`/api/v1/gyms/${gym}/walls/${wall}/published`)).json();
    const body = { route_id: routes[0].id, kind: "top", tries: 2, climbed_at: new Date().toISOString() };
    const init = { method: "PUT", headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
    await fetch(`/api/v1/gyms/${gym}/ascents/${crypto.randomUUID()}`, init);
  }, places);
  await page.getByRole("link", { name: "Heat map" }).first().click();
  await wallDrawn(page);
  await page.getByRole("table", { name: "Heat map" }).waitFor();
  await page.waitForFunction(() => document.querySelector("wall-topo").shadowRoot.querySelector(".heat:not([hidden])"));
  await page.waitForSelector("wall-topo[data-ready=detail]"); // no other model comes between two pictures
  await settle(page);
  const heated = await hues(page);
  assert.ok(heated.warm > 50, "no hold is in the heat's colour");
  assert.equal(heated.cold, 0, "a hold has its own colour");
  await fits(setter, places, "insights-heat-laptop");
  await page.evaluate(() => document.querySelector("wall-topo").showHeat(null));
  assert.notDeepEqual(await hues(page), heated);
  await page.getByRole("link", { name: "Before and after a reset" }).click();
  await page.getByText("kept").or(page.getByText("No resets of this wall yet.")).first().waitFor();
  await fits(setter, places, "insights-resets-laptop");
  await setter.close();
});
