// A wall in review: the table by keyboard alone, publication, and the climbers' view.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "./fixtures.mjs";
import { counted, grave, nameRoutes, OFFLINE, signIn, stored, visit, wallDrawn } from "./place.mjs";

async function typeTable(page) {
  const rows = await nameRoutes(page);
  await page.locator("[data-field=setter]").first().focus();
  await page.keyboard.type("Jana");
  return rows;
}

/** Tap two points of the wall and type their distance, up to the question whether to scan again. */
async function markDistance({ page, shot }) {
  const begun = Date.now();
  const set = page.getByRole("button", { name: "Set the scale" });
  await page.getByRole("button", { name: "Mark two points" }).click();
  const box = await page.locator("wall-topo").locator("canvas").boundingBox();
  for (const share of [0.4, 0.6]) {
    await page.mouse.click(box.x + share * box.width, box.y + box.height / 2);
    await page.waitForTimeout(350); // not a double click
  }
  await page.getByRole("button", { name: "Marked. Mark again" }).waitFor();
  assert.ok(await set.isDisabled());
  await page.getByLabel("Distance between them").fill("1.5");
  assert.deepEqual(await grave(page), []);
  await shot("known-distance");
  await set.click();
  await page.getByRole("dialog").getByText("Compute the wall again with this scale?").waitFor();
  console.log(`a known distance is given in ${(Date.now() - begun) / 1000} s`);
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Marked. Mark again" }).click(); // taps choose holds again
  await page.getByText("Set the scale by a known distance").click();
}

test("a running scan shows the wall as far as it is known", async ({ browser, places }) => {
  const setter = await visit(browser, places, { worker: false });
  await signIn(setter, places, places.setter);
  const { page } = setter;
  const path = `**/gyms/${places.gym}/scans/${places.scan}`;
  const running = async (route) => {
    const facts = await (await route.fetch()).json();
    const progress = { stage: "texture", doing: "painting", total: 10, done: 4, notes: [] };
    await route.fulfill({ json: { ...facts, state: "running", progress } });
  };
  let looks = 0;
  await page.route(path, running);
  await page.route(`${path}/events`, (route) => route.fulfill({ contentType: "text/event-stream", body: "retry: 600000\n\n" }));
  await page.route(`${path}/first-look`, (route) => {
    looks += 1;
    if (looks === 1) return route.fulfill({ status: 204 });
    if (route.request().headers()["if-none-match"]) return route.fulfill({ status: 304 });
    return route.fulfill({ path: places.look, headers: { etag: '"1"' }, contentType: "model/gltf-binary" });
  });
  await setter.go(`/g/${places.gym}/s/${places.scan}`);
  await page.getByText("The wall as the scan knows it so far").waitFor();
  await wallDrawn(page);
  assert.ok(looks >= 2, "it is asked for again while there is none");
  assert.equal(await page.locator("wall-topo [part~=list]").isVisible(), false);
  assert.deepEqual(await grave(page), []);
  await setter.shot("first-look");
});

test("from review to what a climber sees", async ({ browser, places }) => {
  const setter = await visit(browser, places, { phone: false });
  await signIn(setter, places, places.setter);
  const { page } = setter;
  await setter.go(`/g/${places.gym}/s/${places.scan}`);
  await wallDrawn(page);
  // The editor of the scan is there, and leads back.
  await page.getByRole("link", { name: "Edit holds and routes" }).click();
  await wallDrawn(page);
  await page.getByRole("button", { name: "Add a hold" }).waitFor();
  await setter.shot("editor");
  await page.getByRole("link", { name: "Done" }).click();
  await wallDrawn(page);
  // An estimated range beside the grade of a new route; nothing is filled in by it.
  const beside = page.locator(".graded small");
  await beside.filter({ hasText: /^about \d\S* to \d\S*, based on training-board problems only/ }).first().waitFor();
  assert.deepEqual(await page.locator("[data-field=grade]").evaluateAll((all) => all.map(({ value }) => value).filter(Boolean)), []);
  // Who reaches the top of each route, before anybody climbs it.
  const reach = page.getByRole("list", { name: "Reach" });
  await reach.first().waitFor();
  assert.equal(await reach.first().getByRole("listitem").count(), 6);
  await reach.first().scrollIntoViewIfNeeded();
  await setter.shot("review-reach");
  await page.getByLabel("Show estimated grades of new routes").uncheck();
  await beside.first().waitFor({ state: "detached" });
  await page.reload(); // it stays hidden
  await wallDrawn(page);
  assert.equal(await beside.count(), 0);
  await page.getByLabel("Show estimated grades of new routes").check();
  await beside.first().waitFor();
  await markDistance(setter);
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
  await page.getByText("This version is published.").waitFor();

  const climber = await visit(browser, places);
  await climber.go(`/g/${places.gym}`);
  assert.deepEqual(await grave(climber.page), []);
  await climber.shot("gym");
  await climber.page.getByRole("link", { name: "Cave" }).click();
  await wallDrawn(climber.page);
  // No phone that shows a wall in a room.
  assert.equal(await climber.page.locator("a[rel=ar]").count(), 0);
  assert.deepEqual(await grave(climber.page), []);
  await climber.shot("wall");
  await counted(climber.page.locator("main li a"), rows);
  await climber.page.getByRole("searchbox").fill("jana moon");
  await counted(climber.page.locator("main li a"), 1);
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
  assert.match(new URL(climber.page.url()).pathname, /\/r\/[0-9a-f-]{36}$/); // the search stays in the address
  await climber.close();

  // An iPhone and an Android phone show the wall in the room.
  const path = new URL(`${places.address}/g/${places.gym}/w/${places.wall}`).pathname;
  for (const [phone, look, link] of [["iphone", {}, "a[rel=ar]"], ["android", { userAgent: "Mozilla/5.0 (Linux; Android 15)" }, "a[href^='intent:']"]]) {
    const other = await visit(browser, places, look);
    await other.page.addInitScript((isApple) => isApple && (DOMTokenList.prototype.supports = (word) => word === "ar"), phone === "iphone");
    await other.go(path);
    const found = other.page.locator(link);
    await found.scrollIntoViewIfNeeded();
    await wallDrawn(other.page);
    assert.deepEqual(await grave(other.page), []);
    await other.shot(`wall-in-room-${phone}`);
    const target = await found.getAttribute("href");
    const file = phone === "iphone" ? places.address + target : new URLSearchParams(target.split("?")[1].split("#")[0]).get("file");
    const answer = await other.context.request.get(file);
    const [kind, magic] = phone === "iphone" ? ["model/vnd.usdz+zip", "PK"] : ["model/gltf-binary", "glTF"];
    assert.equal(answer.headers()["content-type"], kind);
    assert.equal((await answer.body()).subarray(0, magic.length).toString(), magic);
    await other.close();
  }

  // Stripped, it is gone from the wall, and its address says so.
  const stripped = climber.page.url();
  await page.getByRole("link", { name: "Versions" }).click();
  await page.getByRole("button", { name: "Strip" }).last().click();
  await page.getByRole("dialog").getByRole("button", { name: "Strip" }).click();
  await page.waitForFunction((left) => document.querySelectorAll("main ul.lines .swatch").length === left, rows - 1);
  assert.ok(stripped);
  await setter.close();
});

test("a range leans on the gym's grades", async ({ browser, places }) => {
  for (const phone of [false, true]) {
    const setter = await visit(browser, places, { phone });
    await signIn(setter, places, places.setter);
    const { page } = setter;
    await setter.go(`/g/${places.gym}/s/${places.later}`);
    await wallDrawn(page);
    // Current routes get no range; neither does a new route without a feasible sequence.
    const hanging = page.locator("li", { has: page.locator("[data-field=same]") }).filter({ hasText: "Kept" });
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
});

test("a setter mends a published wall, and takes it back", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  await signIn(setter, places, places.setter);
  const { page } = setter;
  await setter.go(`/g/${places.gym}/w/${places.wall}`);
  await page.locator("main li a", { hasText: "Moon 1" }).first().click();
  // One route, on its card.
  const begun = Date.now();
  await page.getByRole("button", { name: "Edit route" }).click();
  await page.getByLabel("Name").fill("Moon One");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByRole("heading", { name: "Moon One" }).waitFor();
  console.log(`a typo is mended in ${(Date.now() - begun) / 1000} s`);
  assert.deepEqual(await grave(page), []);
  await setter.shot("mended");
  await page.getByRole("button", { name: "Undo" }).last().click();
  await page.getByRole("heading", { name: "Moon 1" }).waitFor();
  // Many routes, in a table.
  await setter.go(`/g/${places.gym}/w/${places.wall}/versions`);
  await page.getByRole("link", { name: "Edit routes" }).click();
  const setters = page.locator("[data-field=setter]");
  await setters.first().fill("Petra");
  await page.keyboard.press("Enter"); // on to the next route's setter
  await page.keyboard.type("Petra");
  await page.getByText("2 unsaved changes").waitFor();
  assert.deepEqual(await grave(page), []);
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByText("Saved.").waitFor();
  await setter.shot("edit-routes");
  await page.reload();
  await page.waitForFunction(() => document.querySelector("[data-field=setter]")?.value === "Petra");
  // The published wall in the editor: a correction, discarded here.
  await page.getByRole("link", { name: "Versions" }).click();
  await page.getByRole("button", { name: "Correct this wall" }).click();
  await wallDrawn(page);
  await page.getByRole("button", { name: "Add a hold" }).waitFor();
  await setter.shot("correct-wall");
  await page.getByRole("link", { name: "Done" }).click();
  await wallDrawn(page);
  const names = page.locator("[data-field=name]");
  await names.first().waitFor();
  const named = await names.count();
  // Alone the route that the first test stripped is new. The summary is not "Kept" itself.
  await counted(page.getByText("Kept", { exact: true }), named - 1);
  await page.getByText(`${named - 1} kept, 1 new`).waitFor();
  await page.getByRole("button", { name: "Discard" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Discard" }).click();
  await page.getByText("Cancelled").waitFor();
  await setter.close();
});

test("half of the wall is photographed anew, and the rest stays", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  await signIn(setter, places, places.setter);
  const { page } = setter;
  await setter.go(`/g/${places.gym}/w/${places.wall}/versions`);
  const begun = Date.now();
  await page.getByRole("button", { name: "New scan" }).click();
  const files = readdirSync(places.photos).sort().slice(0, 5).map((name) => join(places.photos, name));
  await page.setInputFiles("input[type=file]", files);
  await page.getByText("5 usable photos").waitFor();
  await page.getByRole("radio", { name: "a part of it" }).check();
  await page.getByText("routes elsewhere stay as they are").waitFor();
  assert.deepEqual(await grave(page), []);
  await setter.shot("part-of-wall");
  await page.getByRole("button", { name: "Start scan" }).click();
  await page.getByText("of the wall was photographed and replaced").waitFor({ timeout: 600_000 });
  console.log(`half of the wall is rescanned in ${(Date.now() - begun) / 1000} s`);
  await wallDrawn(page);
  assert.deepEqual(await grave(page), []);
  await setter.shot("part-review");
  await page.getByRole("button", { name: "Discard" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Discard" }).click();
  await page.getByText("Cancelled").nth(1).waitFor(); // beside the correction above
  await setter.close();
});

test("embedded it is shown without the rest of the app", async ({ browser, places }) => {
  const guest = await visit(browser, places);
  await guest.page.goto(`${places.address}/embed/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(guest.page);
  assert.equal(await guest.page.locator("header, footer").count(), 0);
  assert.equal(await guest.page.getAttribute("wall-topo", "grab"), "two-fingers");
  assert.deepEqual(await grave(guest.page), []);
  await guest.shot("embed");
  await guest.close();
});

test("the wall seen last is read before the app asks for it", async ({ browser, places }) => {
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
});

test("opens without reception", async ({ browser, places }) => {
  const guest = await visit(browser, places);
  await guest.go("/");
  await guest.page.evaluate(() => navigator.serviceWorker.ready.then(() => undefined));
  await stored(guest.page, "/");
  await guest.page.reload();
  await guest.context.setOffline(true);
  await guest.page.reload();
  await guest.page.getByText("Offline since").waitFor();
  await guest.page.getByRole("heading", { name: "Gyms" }).waitFor();
  await guest.context.setOffline(false);
  guest.expected(OFFLINE);
  await guest.close();
});
