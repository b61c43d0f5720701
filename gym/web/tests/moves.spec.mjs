// A figure climbs a published route: for one's height of the profile, else for the one entered on the phone.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

const PATIENCE_MS = 90_000;

/** The address of a route with moves, once the worker has computed them. */
async function routeWithMoves(page, { gym, wall }) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; await page.waitForTimeout(300)) {
    const version = await page.evaluate((path) => fetch(path, { cache: "no-store" }).then((answer) => answer.json()), `/api/v1/gyms/${gym}/walls/${wall}/published`);
    assert.notEqual(version.moves.state, "failed");
    if (version.moves.state === "waiting") continue;
    assert.ok("moves.json" in version.files);
    const route = version.routes.find(({ number }) => version.moves.routes.includes(number));
    assert.ok(route, "no route of the wall can be climbed");
    return `/g/${gym}/w/${wall}/r/${route.id}`;
  }
  throw new Error(`no moves after ${PATIENCE_MS / 1000} s`);
}

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

test("a route shows its moves for one's own body", async ({ browser, places }) => {
  const begun = Date.now();
  const climber = await visit(browser, places);
  const { page, go } = climber;
  await go(`/g/${places.gym}`);
  const address = await routeWithMoves(page, places);
  await go(address);
  await wallDrawn(page);
  // Without an account: an adult, until height and reach are entered; the phone keeps them.
  const show = page.getByRole("button", { name: "Suggested moves" });
  const shown = (height) => page.getByText(`For a body of ${height} m.`).waitFor();
  await show.click();
  await shown("1.75");
  await page.getByLabel("Height", { exact: true }).fill("158");
  await page.getByLabel(/^Reach, /).press("Tab");
  await shown("1.55");
  const player = page.locator("wall-topo .player");
  for (let move = 0; move < 2; move++) await player.getByRole("button", { name: "Next move" }).click();
  await player.getByText(/^3\//).waitFor();
  assert.equal(await player.getByRole("combobox").inputValue(), "short");
  await page.getByText("For a body of").scrollIntoViewIfNeeded();
  await check(climber, "moves");
  // In feet and inches: the page, the figure's card, and what is entered.
  const measureIn = async (units) => {
    await go(`/g/${places.gym}`);
    await page.getByLabel("Units").selectOption(units);
    await go(address);
    await wallDrawn(page);
    await show.click();
  };
  await measureIn("imperial");
  await page.getByText("For a body of 5 ft 1 in.").waitFor();
  const own = page.getByRole("group", { name: /^Height/ });
  await own.getByLabel("feet").fill("6");
  await own.getByLabel("inches").fill("3");
  await own.getByLabel("inches").press("Tab");
  await page.getByText("For a body of 6 ft 3 in.").waitFor();
  await player.getByRole("option", { name: "6 ft 3 in" }).waitFor({ state: "attached" });
  await page.getByText("For a body of").scrollIntoViewIfNeeded();
  await check(climber, "moves-in-feet");
  await own.getByLabel("feet").fill("20");
  await own.getByLabel("feet").press("Tab");
  await page.getByText("Out of range.").waitFor();
  await measureIn("metric");
  await page.getByLabel("Height", { exact: true }).fill("158");
  await page.getByLabel(/^Reach, /).press("Tab");
  await shown("1.55");
  // Another body in the viewer itself, then away.
  await player.getByRole("combobox").selectOption("tall");
  await shown("1.90");
  await player.getByRole("button", { name: "Close" }).click();
  await show.waitFor();
  await page.reload();
  await wallDrawn(page);
  await show.click();
  await shown("1.55");
  await page.getByRole("link", { name: "Next route" }).click();
  await player.waitFor({ state: "detached" });

  // With an account the profile counts, and nothing is asked.
  await signIn(climber, places, places.member);
  const status = await page.evaluate(async () => {
    const profile = await (await fetch("/api/v1/me/profile")).json();
    const body = JSON.stringify({ ...profile, height_cm: 186, reach_cm: 190 });
    return (await fetch("/api/v1/me/profile", { method: "PUT", headers: { "content-type": "application/json" }, body })).status;
  });
  assert.equal(status, 200);
  await go(address);
  await wallDrawn(page);
  await show.click();
  await shown("1.90");
  assert.equal(await page.getByLabel("Height", { exact: true }).count(), 0);
  await check(climber, "moves-profile");
  await climber.close();

  // Beside a list, and without reception at first.
  const laptop = await visit(browser, places, { phone: false });
  await laptop.go(address);
  await wallDrawn(laptop.page);
  await laptop.context.setOffline(true);
  await laptop.page.getByRole("button", { name: "Suggested moves" }).click();
  await laptop.page.getByText("The moves could not be loaded.").waitFor();
  await laptop.context.setOffline(false);
  await laptop.page.getByRole("button", { name: "Suggested moves" }).click();
  await laptop.page.getByText("For a body of 1.75 m.").waitFor();
  await laptop.page.locator("wall-topo .player").getByRole("button", { name: "Next move" }).click();
  await check(laptop, "moves");
  laptop.expected(OFFLINE);
  await laptop.close();
  console.log(`moves are shown in ${(Date.now() - begun) / 1000} s`);
});

test("routes are found by their holds and moves, and a link shows the same list", async ({ browser, places }) => {
  const member = await visit(browser, places);
  await signIn(member, places, places.member);
  const { page, go } = member;
  const address = await routeWithMoves(page, places);
  const wall = `/g/${places.gym}/w/${places.wall}`;
  const version = await page.evaluate((path) => fetch(path).then((answer) => answer.json()), `/api/v1${wall.replace("/g/", "/gyms/").replace("/w/", "/walls/")}/published`);
  const routes = version.routes.filter(({ number }) => number !== null);
  const listed = () => page.locator("li a[href*='/r/']").count();

  // Of the commonest type; the address has the filter, also after a reload.
  await go(wall);
  await wallDrawn(page);
  await page.getByText("Filter", { exact: true }).click();
  const type = page.getByLabel("Hold type");
  await type.selectOption({ index: 1 });
  const chosen = await type.inputValue();
  const many = routes.filter((route) => (route.hold_types[chosen] ?? 0) * 3 >= route.holds.length).length;
  await page.getByText(`${many} of ${version.routes.length}`).waitFor();
  assert.equal(await listed(), many);
  assert.equal(new URL(page.url()).searchParams.get("type"), chosen);
  await page.reload();
  await page.getByText(`${many} of ${version.routes.length}`).waitFor();
  await page.getByRole("button", { name: "Clear filters" }).click();
  assert.equal(new URL(page.url()).search, "");

  // By the reach of one's own body, of the profile.
  await page.getByText("Filter", { exact: true }).click();
  await page.getByText("For a height of 1.86 m").waitFor();
  const reach = page.getByLabel("Longest reach");
  assert.match(await reach.locator("option").nth(1).textContent(), /^Up to \d\.\d\d m · \d+% of your arm span$/);
  await reach.selectOption({ index: 1 });
  await page.getByRole("checkbox", { name: "Top within reach" }).check();
  await page.getByLabel("Holds", { exact: true }).scrollIntoViewIfNeeded();
  assert.ok((await listed()) < version.routes.length);
  await check(member, "search");
  await page.getByRole("button", { name: "Clear filters" }).click();

  // With one hold.
  const { number, holds } = routes.find(({ id }) => address.endsWith(id));
  await page.evaluate((hold) => document.querySelector("wall-topo").selectHold(hold), holds[0]);
  await page.getByRole("button", { name: "Routes with this hold" }).click();
  await page.getByRole("button", { name: "With this hold" }).waitFor();
  await page.waitForURL((url) => url.searchParams.has("hold"));
  assert.equal(await listed(), routes.filter((route) => route.holds.includes(holds[0])).length, `of route ${number}`);
  await go(`${wall}?hold=00000000-0000-4000-8000-000000000000.${holds[0]}`);
  await page.getByRole("button", { name: "Hold of a former version" }).waitFor();
  await go(`${wall}/problems?hold=${version.scan_id}.${holds[0]}`);
  await page.getByRole("button", { name: "With this hold" }).waitFor();

  // Like another route.
  await go(address);
  await wallDrawn(page);
  await page.getByRole("link", { name: "Find similar routes" }).click();
  await page.getByRole("button", { name: "Similar routes" }).waitFor();
  await page.waitForFunction((all) => document.querySelectorAll("li a[href*='/r/']").length < all, version.routes.length);
  assert.equal(await page.locator(`li a[href='${address}']`).count(), 0);
  await page.getByRole("button", { name: "Similar routes" }).scrollIntoViewIfNeeded();
  await check(member, "similar");
  await member.close();
});

test("a route is heard step by step", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  const { page, go } = climber;
  await page.addInitScript(() => {
    window.said = [];
    const speak = (utterance) => window.said.push([utterance.lang, utterance.text]);
    Object.defineProperty(window, "speechSynthesis", { value: { speak, cancel: () => {}, getVoices: () => [] } });
  });
  await go(`/g/${places.gym}`);
  await go(await routeWithMoves(page, places));
  await page.getByRole("link", { name: "Listen to the moves" }).click();
  const sentence = page.getByRole("status").filter({ hasText: /\w/ });
  await sentence.filter({ hasText: "hand holds" }).waitFor();
  const said = () => page.evaluate(() => window.said);
  assert.deepEqual(await said(), []);
  const next = page.getByRole("button", { name: "Next" });
  await next.click();
  await page.getByText("Step 2 of").waitFor();
  await sentence.filter({ hasText: "Start" }).waitFor();
  await page.keyboard.press("ArrowLeft");
  await page.getByText("Step 1 of").waitFor();
  await page.getByRole("button", { name: "Again" }).click();
  const texts = (await said()).map(([, text]) => text);
  assert.equal(texts.length, 3);
  assert.match(texts[0], /^Start/);
  assert.equal(texts[1], texts[2]);
  await check(climber, "listen");

  // Another language and wording; the phone keeps silent for a friend who reads.
  await page.getByText("Voice and wording").click();
  await page.locator("main").getByRole("combobox", { name: /^Language/ }).selectOption("de");
  await sentence.filter({ hasText: "Griffe für die Hände" }).waitFor();
  await page.getByRole("combobox", { name: /^Detail/ }).selectOption("short");
  await page.getByLabel("The phone speaks").uncheck();
  await next.click();
  await sentence.filter({ hasText: "Start" }).waitFor();
  assert.equal((await said()).length, 3);
  await page.getByText("All steps").click();
  await check(climber, "listen-wording");
  const last = page.getByRole("listitem").last();
  const top = await last.textContent();
  await last.getByRole("button").click();
  await sentence.filter({ hasText: top.trim() }).waitFor();
  assert.ok(await next.isDisabled());
  await climber.close();
});
