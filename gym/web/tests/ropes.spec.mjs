// A setter marks a rope's line on the wall and hangs a route on it; a climber logs it, also without reception.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

/** Tap the wall at a hold until it is taken for a tap, and wait for the number of marked points. */
async function markAt(page, hold, count) {
  const words = count === 1 ? "1 point marked" : `${count} points marked`;
  for (let tries = 0; tries < 20; tries++) {
    // Soon after another tap it would be a double tap.
    await page.waitForTimeout(350);
    const at = await page.evaluate((id) => {
      const wall = document.querySelector("wall-topo");
      window.pointed = false;
      wall.addEventListener("point-tap", () => (window.pointed = true), { once: true });
      const box = wall.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const { x, y } = wall.project(id);
      return { x: box.x + x, y: box.y + y };
    }, hold);
    await page.touchscreen.tap(at.x, at.y);
    if (await page.evaluate(() => new Promise((resolve) => setTimeout(() => resolve(window.pointed), 100)))) {
      return await page.getByText(words).waitFor();
    }
  }
  assert.fail(`no tap on hold ${hold} was taken for one`);
}

/** Holds from the lowest to the highest that a finger can hit. */
function inPicture(page) {
  return page.evaluate(() => {
    const wall = document.querySelector("wall-topo");
    const { clientWidth, clientHeight } = wall.shadowRoot.querySelector("canvas");
    const isIn = ({ id }) => {
      const at = wall.project(id);
      return at?.ahead && at.x > 20 && at.y > 80 && at.x < clientWidth - 20 && at.y < clientHeight - 20 && wall.pickAt(at.x, at.y) === id;
    };
    return wall.holds.filter(isIn).sort((a, b) => a.position[2] - b.position[2]).map(({ id }) => id);
  });
}

test("a line is marked, a route hangs on it, and its climbs have results and a board of their own", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  await signIn(setter, places, places.setter);
  const { page } = setter;
  const wall = `/g/${places.gym}/w/${places.wall}`;
  await setter.go(`${wall}/versions`);
  await page.getByRole("link", { name: "Rope lines" }).click();
  await page.getByText("No lines: all routes").waitFor();
  await page.getByRole("button", { name: "Add a line" }).click();
  assert.equal(await page.getByLabel("Number or name").inputValue(), "1");
  await page.getByLabel("Number or name").fill("7");
  await page.getByLabel("Auto-belay").check();
  await wallDrawn(page);
  const routes = await page.evaluate((path) => fetch(path).then((answer) => answer.json()), `/api/v1/gyms/${places.gym}/routes`);
  const route = routes.find(({ wall_id, number }) => wall_id === places.wall && number !== null);
  const holds = await inPicture(page);
  assert.ok(holds.length >= 3, "the picture shows holds");
  await page.getByRole("button", { name: "Mark clips on the wall" }).click();
  const marked = [holds[0], holds[Math.floor(holds.length / 2)], holds.at(-1)];
  for (const [at, hold] of marked.entries()) await markAt(page, hold, at + 1);
  await check(setter, "ropes-marking");
  await page.getByRole("button", { name: "Remove last point" }).click();
  await page.getByText("2 points marked").waitFor();
  await markAt(page, holds.at(-1), 3);
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("2 clips and an anchor").waitFor();
  await check(setter, "ropes-lines");

  // A route hangs on it: the wall draws its rope, and the card says how it is climbed.
  await setter.go(`${wall}/r/${route.id}`);
  await page.getByRole("button", { name: "Edit route" }).click();
  await page.getByLabel("Rope line").selectOption("7");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("7 · Lead, Top-rope, Auto-belay").waitFor();
  await setter.go(`${wall}/lines`);
  await page.getByRole("button", { name: "Edit 7" }).click();
  await page.getByRole("button", { name: "Delete line" }).click();
  await page.getByRole("button", { name: "Delete line" }).last().click();
  await page.getByText("routes are on line 7").waitFor();

  const climber = await visit(browser, places);
  await signIn(climber, places, places.member);
  await climber.go(`${wall}/r/${route.id}`);
  await wallDrawn(climber.page);
  const log = climber.page.getByRole("group", { name: "Log an ascent" });
  await log.getByRole("button", { name: "Onsight" }).waitFor();
  assert.equal(await log.getByRole("button", { name: "Zone" }).count(), 0);
  await check(climber, "ropes-card");
  // Without reception a high point waits with its clip.
  await climber.context.setOffline(true);
  await log.getByRole("button", { name: "High point" }).click();
  await climber.page.getByLabel("Highest clip").fill("2");
  await check(climber, "ropes-high-point");
  await climber.page.getByRole("button", { name: "Save", exact: true }).click();
  await climber.page.getByText("High point: clip 2 logged.").waitFor();
  await climber.context.setOffline(false);
  await log.getByRole("button", { name: "Onsight" }).waitFor({ state: "detached" });
  await log.getByRole("button", { name: "Redpoint" }).click();
  await climber.page.getByText("Redpoint logged.").waitFor();
  await log.getByRole("button", { name: "Repeat" }).waitFor();
  await climber.page.getByLabel("Top-rope").check();
  await log.getByRole("button", { name: "Top", exact: true }).click();
  await climber.page.getByText("Top logged.").waitFor();
  await climber.page.getByText("not synced yet").first().waitFor({ state: "detached" });

  // Boards and progress tell the ropes apart; the log names the discipline.
  await climber.go(`/g/${places.gym}/board`);
  await climber.page.getByLabel("Discipline").selectOption({ label: "Lead" });
  await climber.page.getByRole("row", { name: /one top/ }).waitFor();
  await check(climber, "ropes-board");
  await climber.go(`/g/${places.gym}/progress`);
  await climber.page.getByLabel("Discipline").selectOption({ label: "Top-rope" });
  await climber.page.getByRole("heading", { name: "Routes by grade" }).waitFor();
  await check(climber, "ropes-progress");
  await climber.go("/me/log");
  await climber.page.getByText("High point: clip 2").waitFor();
  await check(climber, "ropes-log");
});
