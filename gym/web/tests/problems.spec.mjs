// A climber makes a problem on the wall, without reception; another one climbs, remixes and reports it; a setter decides.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

/** Ids of the holds of a route from the lowest to the highest, of those that a finger can hit. */
function reachable(page) {
  return page.evaluate(() => {
    const wall = document.querySelector("wall-topo");
    const canvas = wall.shadowRoot.querySelector("canvas");
    const { clientWidth, clientHeight } = canvas;
    const seen = ({ id }) => {
      const at = wall.project(id);
      return at && at.ahead && at.x > 0 && at.y > 0 && at.x < clientWidth && at.y < clientHeight && wall.pickAt(at.x, at.y) === id;
    };
    return wall.holds.filter(seen).sort((a, b) => a.position[2] - b.position[2]).map(({ id }) => id);
  });
}

/**
 * Tap a hold until the wall takes it for a tap, and wait for the effect. Soon after another tap it would be a double tap; on
 * a busy machine a tap may last too long to be one.
 */
async function tap(page, hold, effect) {
  for (let tries = 0; tries < 20; tries++) {
    await page.waitForTimeout(350);
    const at = await page.evaluate((id) => {
      const wall = document.querySelector("wall-topo");
      window.tapped = undefined;
      wall.addEventListener("hold-tap", (event) => (window.tapped = event.detail.hold?.id), { once: true });
      const box = wall.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const { x, y } = wall.project(id);
      return { x: box.x + x, y: box.y + y };
    }, hold);
    await page.touchscreen.tap(at.x, at.y);
    const tapped = await page.evaluate(() => new Promise((resolve) => setTimeout(() => resolve(window.tapped), 100)));
    if (tapped === undefined) continue;
    assert.equal(tapped, hold, "another hold was tapped");
    return await effect.waitFor();
  }
  assert.fail(`no tap on hold ${hold} was taken for one`);
}

function mark(page, name) {
  return page.getByRole("radio", { name: new RegExp(`^${name}`) });
}

test("a problem is made, climbed, remixed, reported, and becomes a route", async ({ browser, places }) => {
  const maker = await visit(browser, places);
  const { page } = maker;
  await signIn(maker, places, places.judge);
  await maker.go(`/g/${places.gym}/w/${places.wall}`);
  await page.getByRole("link", { name: "Problems" }).click();
  await page.getByText("No problems here yet.").waitFor();
  await page.getByRole("button", { name: "Make a problem" }).click();
  await wallDrawn(page);
  const holds = await reachable(page);
  assert.ok(holds.length >= 5, `only ${holds.length} holds can be tapped`);
  const top = holds.at(-1);
  for (const [use, hold] of [["Start", holds[0]], ["Hand", holds[2]], ["Foot only", holds[1]], ["Top", top]]) {
    await mark(page, use).click();
    await tap(page, hold, mark(page, use).getByText("1"));
  }
  // A second tap with the same mark takes it back.
  await tap(page, top, page.getByText("Mark one to four start holds"));
  await tap(page, top, page.getByText(/Within reach|Out of reach/));
  await page.getByLabel("Name").fill("Tiny traverse");
  await page.getByLabel("Grade (optional)").selectOption({ index: 3 });
  await check(maker, "problem-maker");

  await maker.context.setOffline(true);
  await page.getByRole("button", { name: "Save problem" }).click();
  await page.getByRole("heading", { name: "Tiny traverse" }).waitFor();
  await page.getByText("Not synced yet").waitFor();
  await maker.context.setOffline(false);
  await page.getByText("Not synced yet").waitFor({ state: "detached" });
  maker.expected(OFFLINE);
  await check(maker, "problem");
  await page.getByRole("button", { name: "I climbed it" }).click();
  await page.getByText("1 climber").waitFor();

  const other = await visit(browser, places);
  await signIn(other, places, places.member);
  await other.go(`/g/${places.gym}/w/${places.wall}/problems`);
  await check(other, "problems");
  await other.page.getByRole("link", { name: /Tiny traverse/ }).click();
  await wallDrawn(other.page);
  await other.page.waitForFunction((id) => document.querySelector("wall-topo").shadowRoot.querySelectorAll(".flag").length === 3, top);
  await other.page.getByRole("button", { name: "Remix" }).click();
  await mark(other.page, "Top").getByText("1").waitFor();
  await other.page.getByLabel("Name").fill("Tiny remix");
  await other.page.getByLabel("Who sees it").selectOption("link");
  await other.page.getByRole("button", { name: "Save problem" }).click();
  await other.page.getByRole("heading", { name: "Tiny remix" }).waitFor();
  await other.page.getByText("Not synced yet").waitFor({ state: "detached" });
  const link = new URL(other.page.url()).pathname;
  await other.page.getByRole("link", { name: "← Problems" }).click();
  await other.page.getByRole("link", { name: /Tiny traverse/ }).click();
  await other.page.getByRole("button", { name: "Report" }).click();
  await other.page.getByRole("dialog").getByRole("button", { name: "Report" }).click();
  await other.page.getByText("The gym will look at it.").waitFor();
  await other.close();

  // People with the link see the problem, but no list and no names.
  const passer = await visit(browser, places);
  await passer.go(link);
  await passer.page.getByRole("heading", { name: "Tiny remix" }).waitFor();
  assert.equal(await passer.page.getByText("member", { exact: true }).count(), 0);
  await wallDrawn(passer.page);
  await check(passer, "problem-by-link");
  await passer.close();

  const setter = await visit(browser, places);
  await signIn(setter, places, places.owner);
  await setter.go(`/g/${places.gym}/settings/comments`);
  await setter.page.getByText("Tiny traverse").first().waitFor();
  await check(setter, "problem-reports");
  await setter.page.getByRole("button", { name: "Keep" }).click();
  await setter.page.getByText("Tiny traverse").waitFor({ state: "detached" });
  await setter.go(`/g/${places.gym}/w/${places.wall}/problems`);
  assert.equal(await setter.page.getByText("Tiny remix").count(), 0);
  // By a hold that it uses, and by one that it does not.
  await wallDrawn(setter.page);
  const pick = (id) => setter.page.evaluate((one) => document.querySelector("wall-topo").selectHold(one), id);
  await pick(holds[3]);
  await setter.page.getByText("No problems here yet.").waitFor();
  await pick(top);
  await setter.page.getByRole("link", { name: /Tiny traverse/ }).waitFor();
  await setter.page.getByRole("button", { name: /With this hold/ }).click();
  await setter.page.getByRole("link", { name: /Tiny traverse/ }).click();
  await setter.page.getByRole("button", { name: "Make it a route" }).click();
  await setter.page.getByRole("dialog").getByRole("button", { name: "Make it a route" }).click();
  await setter.page.getByRole("link", { name: "A setter made this a route." }).click();
  await setter.page.getByRole("heading", { name: "Tiny traverse" }).waitFor();
  await setter.close();

  await maker.go(`/g/${places.gym}/w/${places.wall}/problems`);
  await page.getByRole("link", { name: /Tiny traverse/ }).click();
  await page.getByRole("button", { name: "Remove" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Remove" }).click();
  await page.getByText("No problems here yet.").waitFor();
  await maker.close();
});

test("a problem is made by keys alone", async ({ browser, places }) => {
  const maker = await visit(browser, places);
  const { page } = maker;
  await signIn(maker, places, places.member);
  await maker.go(`/g/${places.gym}/w/${places.wall}`);
  await page.getByRole("link", { name: "Problems" }).press("Enter");
  await page.getByRole("button", { name: "Make a problem" }).press("Enter");
  await wallDrawn(page);
  const wall = page.locator("wall-topo").getByRole("img");
  const heard = page.locator("wall-topo").getByRole("status");
  await mark(page, "Start").press("Enter");
  await wall.press("Shift+ArrowRight");
  await wall.press("Enter");
  await mark(page, "Start").getByText("1").waitFor();
  await heard.filter({ hasText: "Start" }).waitFor({ state: "attached" });
  await mark(page, "Top").press("Enter");
  await wall.press("Shift+ArrowUp");
  await wall.press("Enter");
  await mark(page, "Top").getByText("1").waitFor();
  await heard.filter({ hasText: "Top" }).waitFor({ state: "attached" });
  await page.getByText(/Within reach|Out of reach/).waitFor();
  await maker.shot("problem-by-keys");
  // The moves of a body, and holds that would open it to shorter ones.
  await page.getByRole("button", { name: "Suggested moves" }).click();
  await page.getByText(/For a body of/).waitFor();
  assert.deepEqual(await grave(page), []);
  await maker.shot("problem-moves");
  await page.getByRole("button", { name: "Hide the figure" }).click();
  await page.getByText(/For a body of/).waitFor({ state: "detached" });
  await maker.close();
});
