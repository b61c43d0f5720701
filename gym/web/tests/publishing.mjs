// A wall in review: the table by keyboard alone, publication, and what a climber sees of it.

import assert from "node:assert/strict";
import { grave, signIn, visit, wallDrawn } from "./place.mjs";

async function typeTable(page) {
  await page.locator("[data-field=name]").first().focus();
  const rows = await page.locator("[data-field=name]").count();
  for (let row = 1; row <= rows; row++) {
    await page.keyboard.type(`Moon ${row}`);
    await page.keyboard.press("Enter");
  }
  await page.locator("[data-field=grade]").first().focus();
  await page.keyboard.type("6A");
  await page.keyboard.press("Enter");
  await page.locator("[data-field=setter]").first().focus();
  await page.keyboard.type("Jana");
  return rows;
}

export const publishing = {
  async "from review to what a climber sees"(browser, places) {
    const setter = await visit(browser, places, { phone: false });
    await signIn(setter, places, places.setter);
    const { page } = setter;
    await setter.go(`/g/${places.gym}/s/${places.scan}`);
    await wallDrawn(page);
    // The editor of the scan is there, and leads back.
    await page.getByRole("link", { name: "Correct the scan" }).click();
    await wallDrawn(page);
    await page.getByRole("button", { name: "Add a hold" }).waitFor();
    await setter.shot("editor");
    await page.getByRole("link", { name: "Done" }).click();
    await wallDrawn(page);
    // Beside the grade of a new route stands about how hard it is; nothing is filled in by it.
    const beside = page.locator(".graded small");
    await beside.filter({ hasText: /^about \d\S* to \d\S*, from a board's problems alone/ }).first().waitFor();
    assert.deepEqual(await page.locator("[data-field=grade]").evaluateAll((all) => all.map(({ value }) => value).filter(Boolean)), []);
    await page.getByLabel("Show about how hard new routes are").uncheck();
    await beside.first().waitFor({ state: "detached" });
    await page.reload(); // it stays hidden
    await wallDrawn(page);
    assert.equal(await beside.count(), 0);
    await page.getByLabel("Show about how hard new routes are").check();
    await beside.first().waitFor();
    const rows = await typeTable(page);
    assert.ok(rows > 1);
    // A closed tab loses nothing of it.
    await page.reload();
    await page.waitForFunction(() => document.querySelector("[data-field=name]")?.value === "Moon 1");
    await wallDrawn(page);
    assert.deepEqual(await grave(page), []);
    await setter.shot("review");
    await page.getByRole("button", { name: "Publish" }).focus();
    await page.keyboard.press("Enter");
    await page.getByText("This is what everybody sees.").waitFor();

    const climber = await visit(browser, places);
    await climber.go(`/g/${places.gym}`);
    assert.deepEqual(await grave(climber.page), []);
    await climber.shot("gym");
    await climber.page.getByRole("link", { name: "Cave" }).click();
    await wallDrawn(climber.page);
    assert.deepEqual(await grave(climber.page), []);
    await climber.shot("wall");
    assert.equal(await climber.page.locator("main li a").count(), rows);
    await climber.page.getByRole("searchbox").fill("jana moon");
    assert.equal(await climber.page.locator("main li a").count(), 1);
    await climber.page.locator("main li a").click();
    await climber.page.getByRole("heading", { name: "Moon 1" }).waitFor();
    await climber.page.locator("article .grade", { hasText: "6A" }).waitFor();
    await climber.page.waitForFunction(() => document.querySelector("wall-topo").selectedRoute !== null);
    assert.deepEqual(await grave(climber.page), []);
    await climber.shot("route");

    // The route's address alone shows the same; a hold of another route leads on.
    await climber.page.reload();
    await wallDrawn(climber.page);
    const lit = () => climber.page.evaluate(() => document.querySelector("wall-topo").selectedRoute);
    await climber.page.waitForFunction(() => document.querySelector("wall-topo").selectedRoute !== null);
    const before = await lit();
    await climber.page.evaluate((now) => {
      const wall = document.querySelector("wall-topo");
      wall.selectRoute(wall.routes.map(({ id }) => id).find((id) => id !== now));
    }, before);
    await climber.page.getByRole("heading", { name: "Moon 1" }).waitFor({ state: "detached" });
    assert.match(climber.page.url(), /\/r\/[0-9a-f-]{36}$/);
    await climber.close();

    // Stripped, it is gone from the wall, and its address says so.
    const stripped = climber.page.url();
    await page.getByRole("link", { name: "Versions" }).click();
    await page.getByRole("button", { name: "Strip" }).last().click();
    await page.getByRole("dialog").getByRole("button", { name: "Strip" }).click();
    await page.waitForFunction((left) => document.querySelectorAll("main ul.lines .swatch").length === left, rows - 1);
    assert.ok(stripped);
    await setter.close();
  },

  async "a range leans on the gym's grades"(browser, places) {
    for (const phone of [false, true]) {
      const setter = await visit(browser, places, { phone });
      await signIn(setter, places, places.setter);
      const { page } = setter;
      await setter.go(`/g/${places.gym}/s/${places.later}`);
      await wallDrawn(page);
      // Of what hangs already nothing is said; a new route without a way up gets no range.
      const hanging = page.locator("li", { has: page.locator("[data-field=same]") }).filter({ hasText: "Still there" });
      assert.equal(await hanging.locator(".graded small").count(), 0);
      for (const same of await page.locator("[data-field=same]").all()) await same.selectOption("");
      const beside = page.locator(".graded", { has: page.locator("small").filter({ hasText: /^about \d\S* to \d\S*,? / }) }).first();
      await beside.waitFor();
      assert.equal(await beside.locator("[data-field=grade]").evaluate((at) => document.getElementById(at.getAttribute("aria-describedby")).textContent.slice(0, 5)), "about");
      await beside.scrollIntoViewIfNeeded();
      assert.deepEqual(await grave(page), []);
      await setter.shot("grade-range");
      await page.evaluate(() => localStorage.clear());
      await setter.close();
    }
  },

  async "embedded it is shown without the rest of the app"(browser, places) {
    const guest = await visit(browser, places);
    await guest.page.goto(`${places.address}/embed/g/${places.gym}/w/${places.wall}`);
    await wallDrawn(guest.page);
    assert.equal(await guest.page.locator("header, footer").count(), 0);
    assert.equal(await guest.page.getAttribute("wall-topo", "grab"), "two-fingers");
    assert.deepEqual(await grave(guest.page), []);
    await guest.shot("embed");
    await guest.close();
  },

  async "the wall seen last is read before the app asks for it"(browser, places) {
    const guest = await visit(browser, places);
    await guest.page.goto(`${places.address}/g/${places.gym}/w/${places.wall}`);
    await wallDrawn(guest.page);
    await guest.page.reload();
    await wallDrawn(guest.page);
    const [tiers, answers] = await guest.page.evaluate(() =>
      [/page\/first\.glb$/, /\/published$/].map((name) => performance.getEntriesByType("resource").filter((entry) => name.test(entry.name)).map(({ startTime }) => startTime)),
    );
    assert.ok(Math.min(...tiers) < Math.min(...answers), `${tiers} is not before ${answers}`);
    await guest.close();
  },

  async "opens without reception"(browser, places) {
    const guest = await visit(browser, places);
    await guest.go("/");
    await guest.page.evaluate(() => navigator.serviceWorker.ready.then(() => undefined));
    await guest.page.waitForFunction(async () => (await caches.keys()).length > 0 && (await caches.match("/")) !== undefined);
    await guest.page.reload();
    await guest.context.setOffline(true);
    await guest.page.reload();
    await guest.page.getByText("Offline.").waitFor();
    await guest.page.getByRole("heading", { name: "Gyms" }).waitFor();
    await guest.context.setOffline(false);
    guest.log.length = 0; // what could not be fetched
    await guest.close();
  },
};
