// Competitions made from usual formats: waves and attempts of climbers, and a judge without an account who scans a code.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { answered, becomes, grave, OFFLINE, signIn, stored, tooWide, visit } from "./place.mjs";

const SMALL = { width: 360, height: 740 };

async function fine(somebody, name) {
  assert.deepEqual(await grave(somebody.page), [], name);
  const wide = await tooWide(somebody.page);
  assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
  await somebody.page.screenshot({ path: somebody.picture(`judging-${name}`), fullPage: true });
}

async function small(browser, places) {
  const somebody = await visit(browser, places);
  await somebody.page.setViewportSize(SMALL);
  return { ...somebody, picture: (name) => `${places.shots}/${name}.png` };
}

/** A request of the browser's person about a competition. */
function request(page, gym, method, path, body) {
  return page.evaluate(async ([of, how, where, what]) => {
    const answer = await fetch(`/api/v1/gyms/${of}/competitions${where}`, { method: how, headers: { "content-type": "application/json" }, body: JSON.stringify(what) });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  }, [gym, method, path, body]);
}

const on = ({ page }) => page.getByRole("button", { name: "Continue" }).click();

/** A time for a field, in minutes from now, by the clock of the gym (UTC). */
const field = (minutes) => new Date(Date.now() + minutes * 60_000).toISOString().slice(0, 16);

/** A night of tops and zones with a wave, from its format; its address. */
async function madeNight(setter, places) {
  const { page } = setter;
  await setter.go(`/g/${places.gym}/competitions/new`);
  await page.getByLabel("Competition name").fill("Zone Night");
  await page.getByRole("radio", { name: /^Tops and zones/ }).check();
  await fine(setter, "formats");
  await on(setter);
  await page.getByLabel("Problems not on the wall yet").fill("3");
  await on(setter);
  await page.getByLabel("Category name").first().waitFor();
  await on(setter);
  await becomes(() => page.getByLabel("Attempts allowed on each problem").inputValue(), "5");
  await fine(setter, "attempts");
  await on(setter);
  await page.getByRole("button", { name: "Add wave" }).click();
  await page.getByLabel("Places").fill("1");
  await page.getByLabel(/^Starts/).fill(field(-60));
  await page.getByLabel(/^Ends/).fill(field(60));
  await page.getByRole("button", { name: "Add wave" }).click();
  await becomes(() => page.getByLabel(/^Starts/).nth(1).inputValue(), await page.getByLabel(/^Ends/).first().inputValue());
  await fine(setter, "waves");
  await on(setter);
  await page.getByText("5 attempts are allowed on each.").waitFor();
  await page.getByRole("button", { name: "Create competition" }).click();
  await page.getByRole("heading", { name: "Zone Night" }).waitFor();
  await page.getByRole("button", { name: "Open entries" }).click();
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await page.getByText("The competition is running.").waitFor();
  return new URL(page.url()).pathname;
}

/** A climber chooses the wave that runs, and has five attempts. */
async function climbed(climber, place) {
  const { page } = climber;
  await climber.go(place);
  await page.getByRole("radio", { name: /^Wave 1: .*1 place free/ }).check();
  await fine(climber, "entry");
  await page.getByRole("button", { name: "Enter", exact: true }).click();
  await page.getByText(/Your wave: Wave 1/).waitFor();
  await climber.go(`${place}/card`);
  await page.getByRole("main").locator("li button").first().click();
  for (let left = 4; left > 0; left -= 1) {
    await page.getByRole("button", { name: /^Try/ }).click();
    await page.getByText(left === 1 ? "1 attempt left" : `${left} attempts left`).waitFor();
  }
  // The zone of the last attempt leaves its top alone.
  await page.getByRole("button", { name: /^Zone/ }).click();
  await page.getByText("No attempts left.").waitFor();
  await page.getByRole("button", { name: "Fell: next try" }).click();
  await becomes(() => page.getByRole("button", { name: /^(Try|Zone|Top)/ }).evaluateAll((keys) => keys.map((key) => key.disabled)), [true, true, true]);
  await page.getByText("Everything is synced.").waitFor();
  await fine(climber, "card");
}

/** The IFSC's format, with two climbers, and running; its address. */
async function madeCup(setter, places) {
  const { page } = setter;
  await setter.go(`/g/${places.gym}/competitions/new`);
  await page.getByLabel("Competition name").fill("Boulder Cup");
  await page.getByRole("radio", { name: /^IFSC boulder/ }).check();
  await on(setter);
  await page.getByText("5 problems", { exact: true }).waitFor();
  await page.getByText("4 problems", { exact: true }).waitFor();
  await becomes(() => page.getByLabel("Qualifiers per category").inputValue(), "8");
  const plan = page.getByText("Start, isolation, rotation").last();
  await plan.click();
  await page.getByLabel(/^Starts/).last().fill(field(120));
  await page.getByLabel("Isolation closes, minutes").last().fill("45");
  await page.getByLabel("Minutes between two climbers").last().fill("5");
  await fine(setter, "cup-problems");
  await on(setter);
  await page.getByLabel("Category name").first().waitFor();
  await on(setter);
  await page.getByText("25 points for a top").first().waitFor();
  await on(setter);
  await on(setter);
  await page.getByRole("button", { name: "Create competition" }).click();
  await page.getByRole("heading", { name: "Boulder Cup" }).waitFor();
  const place = new URL(page.url()).pathname;
  const id = place.split("/").at(-1);
  const { categories } = await request(page, places.gym, "PUT", `/${id}/state`, { state: "running" });
  for (const name of ["Dana Malá", "Ema Roth"]) {
    await request(page, places.gym, "POST", `/${id}/entries`, { name, category_id: categories[0].id, gender: "women" });
  }
  return place;
}

/** A sheet with a code for each problem, and the address of a code of the first one. */
async function printed(setter, place) {
  const { page } = setter;
  await setter.go(place);
  await page.getByRole("link", { name: "Judges without an account" }).click();
  await page.getByRole("button", { name: "Make a sheet of all codes" }).first().click();
  const waits = page.waitForEvent("download");
  await page.getByRole("link", { name: "Save the sheet (PDF)" }).click();
  const file = await waits;
  assert.equal(file.suggestedFilename(), "judge-links.pdf");
  await file.saveAs(setter.picture("judging-sheet").replace(/png$/, "pdf"));
  await page.getByRole("button", { name: /^Code for Problem 1/ }).first().click();
  await page.getByRole("img", { name: /^QR code to judge Problem 1/ }).waitFor();
  await fine(setter, "codes");
  return page.locator(".code a").getAttribute("href");
}

/** A top without reception, by somebody without an account. */
async function judged(judge, places, address) {
  const { page, context, expected } = judge;
  await page.goto(address);
  await page.getByLabel("Your name").fill("Eva Nová");
  await fine(judge, "open");
  await page.getByRole("button", { name: "Start judging" }).click();
  await page.getByText("Judge: Eva Nová").waitFor();
  const at = new URL(page.url());
  assert.equal(at.hash, "");
  const link = at.pathname.split("/").at(-1);
  await page.locator("[data-kept=yes]").waitFor();
  await stored(page, `/api/v1/judge-links/${link}/pad`, /Dana/);
  await context.setOffline(true);
  await page.getByRole("button", { name: /1 Dana/ }).last().click();
  await page.getByRole("button", { name: "Top try 1" }).click();
  await page.getByText("Top, try 1: saved.").waitFor();
  await page.getByText("1 entry waiting to sync").waitFor();
  await fine(judge, "pad-offline");
  await page.reload();
  await page.getByText("1 entry waiting to sync").waitFor();
  await context.setOffline(false);
  await page.evaluate(() => dispatchEvent(new Event("online")));
  await page.getByText("Everything is synced.").waitFor();
  await page.getByRole("button", { name: /1 Dana/ }).last().click();
  await page.getByText("History (1 entry)").click();
  await page.getByText("judge’s link of Problem 1 (Eva Nová)").waitFor();
  await fine(judge, "pad");
  expected(OFFLINE, answered(403));
}

test("waves, attempts, and a judge without an account", async ({ browser, places }) => {
  const setter = await small(browser, places);
  await signIn(setter, places, places.setter);
  const night = await madeNight(setter, places);
  const climber = await small(browser, places);
  await signIn(climber, places, places.member);
  await climbed(climber, night);
  await climber.close();

  const place = await madeCup(setter, places);
  const address = await printed(setter, place);
  const guest = await small(browser, places);
  await guest.go(`${place}/board`);
  await guest.page.locator("[data-live=true]").waitFor();
  const judge = await small(browser, places);
  await judged(judge, places, address);
  await guest.page.getByRole("row", { name: /^1 Dana/ }).getByText("25").waitFor();
  await guest.close();

  // The setter sees who judged, and revokes the code.
  const { page } = setter;
  await setter.go(`${place}/judge-links`);
  const row = page.getByRole("listitem").filter({ hasText: "Eva Nová, last used" });
  await fine(setter, "codes-in-use");
  await row.getByRole("button", { name: "Revoke" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Revoke" }).click();
  await row.waitFor({ state: "detached" });
  await judge.page.reload();
  await judge.page.getByText(/judge's link was revoked/).waitFor();
  await fine(judge, "revoked");
  await judge.close();
  await setter.go(`${place}/order`);
  await page.getByRole("button", { name: "Final" }).click();
  await page.getByText(/Isolation closes/).waitFor();
  await fine(setter, "order");
  await setter.close();
});
