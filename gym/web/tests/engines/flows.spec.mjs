// What climbers and setters do, in an engine that Playwright does not drive. Nothing here knows which one.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { button, link, saying, until } from "./driver.mjs";
import { test } from "./fixtures.mjs";

const ROUTE = "//main//li//a[contains(., 'Moon')]";
const TICKS = "//main//*[@role='group' and @aria-label='Log an ascent']";
const tick = (kind) => `${TICKS}//button[contains(., "${kind}")]`;

/** Wait until the wall's first tier is drawn. */
const drawn = (page) => page.find("//wall-topo[@data-ready='first' or @data-ready='detail']");

/** Mean colours of a coarse grid over the wall's picture. */
function cells(page) {
  return page.evaluate(async () => {
    const picture = await createImageBitmap(await document.querySelector("wall-topo").screenshot());
    const canvas = Object.assign(document.createElement("canvas"), { width: 24, height: 16 });
    const pen = canvas.getContext("2d");
    pen.drawImage(picture, 0, 0, 24, 16);
    return [...pen.getImageData(0, 0, 24, 16).data];
  });
}

/** How many different colours `cells` saw: a blank picture has one. */
function colours(values) {
  const seen = new Set();
  for (let at = 0; at < values.length; at += 4) seen.add(values.slice(at, at + 3).map((value) => value >> 5).join());
  return seen.size;
}

/** The server's data, as the page's person may see it. */
const result = (page, path) => page.evaluate((address) => fetch(address, { cache: "no-store" }).then((answer) => answer.json()), `/api/v1${path}`);
const ascents = async (page) => (await result(page, "/me/ascents?size=200")).items;

/** Open a route of the gym's wall; the browser has by then what it needs without reception. */
async function openRoute(page, places) {
  await page.go(`/g/${places.gym}/w/${places.wall}`);
  await drawn(page);
  await page.becomes(async (wanted) => {
    const lists = await Promise.all((await caches.keys()).map(async (name) => (await caches.open(name)).keys()));
    const kept = lists.flat().map(({ url }) => url).join(" ");
    return wanted.every((part) => kept.includes(part));
  }, ["/page/first.glb", "/page/labels.json", "/published", "/logbook", "/assets/viewer-"]);
  await page.click(ROUTE);
  await page.find(tick("Top"));
}

test("a guest sees the wall drawn, and a route", async ({ visitor: page, places }) => {
  await page.go(`/g/${places.gym}`);
  await page.click(link("Cave"));
  await drawn(page);
  const before = await cells(page);
  assert.ok(colours(before) > 5, "the wall is blank");
  await page.click(ROUTE);
  await page.find("//main//h2[contains(., 'Moon')]");
  await page.becomes(() => document.querySelector("wall-topo").selectedRoute !== null);
  // The other holds lose their colour.
  await until(async () => (await cells(page)).some((value, at) => Math.abs(value - before[at]) > 20), "the picture changes");
});

test("the wall comes back after the graphics were lost, and after the page was left", async ({ visitor: page, places }) => {
  await page.go(`/g/${places.gym}/w/${places.wall}`);
  await drawn(page);
  const before = colours(await cells(page)); // of the first tier or the next
  const isLost = () => page.evaluate(() => document.querySelector("wall-topo").stage.renderer.getContext().isContextLost());
  const lose = () => {
    window.lost = document.querySelector("wall-topo").stage.renderer.getContext().getExtension("WEBGL_lose_context");
    window.lost.loseContext();
  };
  for (const [gone, back] of [
    [lose, () => window.lost.restoreContext()],
    // "Back" from another page; iOS ends pages that keep the memory meanwhile.
    [() => void dispatchEvent(new PageTransitionEvent("pagehide", { persisted: true })), () => void dispatchEvent(new PageTransitionEvent("pageshow", { persisted: true }))],
  ]) {
    await page.evaluate(gone);
    await until(isLost, "the graphics are lost");
    await page.becomes(() => document.querySelector("wall-topo").shadowRoot.textContent.includes("The graphics were interrupted"));
    await page.evaluate(back);
    await until(async () => !(await isLost()) && colours(await cells(page)) > before / 2, "the wall is drawn again");
  }
});

test("a tick arrives", async ({ page, places }) => {
  await openRoute(page, places);
  const before = (await ascents(page)).length;
  await page.click(tick("Zone"));
  await page.says("Zone logged");
  await until(async () => (await ascents(page)).length === before + 1, "the tick is on the server");
});

test("ticks without reception arrive once each on return", async ({ page, places, network }) => {
  await openRoute(page, places);
  const before = (await ascents(page)).length;
  network.set("cut");
  await page.reload();
  await drawn(page);
  await page.says("Offline since");
  await page.click(tick("Top"));
  await page.says("1 change waiting to sync");
  await page.click(tick("Zone"));
  await page.says("2 changes waiting to sync");
  network.set("open");
  await page.evaluate(() => void dispatchEvent(new Event("focus")));
  await until(async () => (await ascents(page)).length === before + 2, "both are on the server");
  await page.go("/me/waiting");
  await page.says("Everything is synced.");
  assert.equal((await ascents(page)).length, before + 2);
});

test("behind a captive portal a tick waits, and the page says why", async ({ page, places, network }) => {
  await openRoute(page, places);
  const before = (await ascents(page)).length;
  network.set("portal");
  await page.click(tick("Zone"));
  await page.says("This network wants you to sign in first.");
  await page.says("1 change waiting to sync");
  network.set("open");
  await page.evaluate(() => void dispatchEvent(new Event("focus")));
  await until(async () => (await ascents(page)).length === before + 1, "the tick is on the server");
});

test("photos get through a broken connection, chosen once", async ({ page, places, network }) => {
  await page.go(`/g/${places.gym}/w/${places.wall}/versions`);
  await page.click(button("New scan"));
  const photos = readdirSync(places.photos).sort().slice(0, 4).map((name) => join(places.photos, name));
  const chooser = "//main//input[@type='file']";
  await page.find(chooser);
  network.cutAfter(150_000); // in the third photo
  await page.choose(chooser, photos);
  await until(() => network.isCut, "the connection breaks");
  network.set("open");
  await page.says("4 usable photos");
});

test("a blocked camera says so, and files are chosen instead", async ({ page, places }) => {
  await page.go(`/g/${places.gym}/w/${places.wall}/versions`);
  await page.click(button("New scan"));
  await page.evaluate(() => void (navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("no", "NotAllowedError"))));
  await page.click(button("Take photos"));
  await page.says("The camera is blocked for this site.");
  await page.choose("//dialog//input[@type='file']", [join(places.photos, readdirSync(places.photos).sort()[5])]);
  await page.find("//dialog//*[normalize-space()='1 photo']");
  await page.click(button("Done"));
  await page.says("One usable photo");
});

test("a review keeps what was typed, and the editor opens", async ({ page, places }) => {
  await page.go(`/g/${places.gym}/s/${places.later}`);
  await drawn(page);
  await page.fill("//*[@data-field='name']", "Sun");
  await page.evaluate(() => document.activeElement.blur());
  await page.reload();
  await page.becomes(() => document.querySelector("[data-field=name]")?.value === "Sun");
  await page.click(link("Edit holds and routes"));
  await drawn(page);
  await page.becomes(() => document.querySelector("wall-topo").shadowRoot.textContent.includes("Add a hold"));
  assert.ok(colours(await cells(page)) > 5, "the editor's wall is blank");
});

test("a board shows a score while it is open", async ({ page, places }) => {
  const { id, entry, problem } = places.competition;
  await page.go(`/g/${places.gym}/competitions/${id}/board`);
  await page.find("//*[@data-live='true']");
  await page.evaluate(async (address, entry_id, problem_id) => {
    const now = new Date().toISOString();
    const event = { entry_id, problem_id, kind: "top", n: 1, device: "check", number: 1, made_at: now, sent_at: now };
    const headers = { "content-type": "application/json" };
    const answer = await fetch(`${address}/${crypto.randomUUID()}`, { method: "PUT", headers, body: JSON.stringify(event) });
    if (!answer.ok) throw new Error(await answer.text());
  }, `/api/v1/gyms/${places.gym}/competitions/${id}/events`, entry, problem);
  await page.find("//tr[contains(., 'Anna Roth') and contains(., '1')]");
});
