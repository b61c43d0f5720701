// What must hold of the viewer under fingers, mouse and animation.

import assert from "node:assert/strict";
import { ask, fine, fingers, open, outside, placeOf, ready, settle, state, tapHold, text } from "./browser.mjs";
import { test } from "./fixtures.mjs";

const PHONE = { width: 390, height: 844, phone: true };
const sheet = (page) => ask(page, (wall) => wall.shadowRoot.querySelector(".side").dataset.height);
const distance = ([a, b, c, d, e, f]) => Math.hypot(a - d, b - e, c - f);
const camera = (page) => ask(page, (wall) => wall.camera);

/** Two fingers from `from` to `to` CSS pixels apart around a point. */
function pinch(page, { x, y }, from, to) {
  const way = (side) => [0, 1, 2, 3, 4, 5, 6].map((step) => ({ x: x + (side * (from + ((to - from) * step) / 6)) / 2, y }));
  return fingers(page, way(-1), way(1));
}

/** Two taps a tenth of a second apart, however busy this machine is. */
async function tapTwice(page, at) {
  const client = await page.context().newCDPSession(page);
  const began = Date.now() / 1000;
  for (const [k, type] of ["touchStart", "touchEnd", "touchStart", "touchEnd"].entries()) {
    const touchPoints = type === "touchStart" ? [at] : [];
    await client.send("Input.dispatchTouchEvent", { type, touchPoints, timestamp: began + 0.05 * k });
  }
}

test("two fingers zoom, two taps look closer", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk, PHONE);
  const at = await placeOf(page, 8);
  const whole = await camera(page);
  await pinch(page, at, 60, 160);
  await settle(page);
  const near = await camera(page);
  assert.ok(distance(near) < 0.8 * distance(whole), `${distance(whole)} m to ${distance(near)} m`);
  assert.equal((await state(page)).hold, null, "a pinch chose a hold");
  await ask(page, (wall) => wall.home());
  await settle(page);
  await tapTwice(page, at);
  await settle(page);
  const looked = await camera(page);
  assert.ok(distance(looked) < 0.8 * distance(whole), "two taps did not look closer");
  const hold = await ask(page, (wall) => wall.holds.find(({ id }) => id === 8).position);
  const off = Math.hypot(...hold.map((value, k) => value - looked[3 + k]));
  assert.ok(off < 0.3, `two taps looked ${off} m beside the hold`);
  fine(log);
  await close();
});

test("the list of a phone is a sheet", async ({ browser, places: { disk, shots } }) => {
  const { page, close } = await open(browser, disk, PHONE);
  const wall = page.locator("wall-topo");
  assert.equal(await sheet(page), "half");
  const row = await wall.locator('[data-route="1"]').boundingBox();
  assert.ok(row.y > 200 && row.y + row.height < 844, `the first route is at ${row.y}`);
  await wall.getByRole("button", { name: "Hide the list" }).press("Enter");
  assert.equal(await sheet(page), "low");
  const handle = await wall.getByRole("button", { name: "Show the list" }).boundingBox();
  const at = { x: handle.x + handle.width / 2, y: handle.y + 8 };
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x, at.y - 120, { steps: 4 });
  await page.mouse.up();
  assert.equal(await sheet(page), "half");
  assert.deepEqual(await outside(page), []);
  await wall.locator('[data-route="2"]').click();
  assert.equal(await sheet(page), "low", "the card took the list's place");
  await settle(page);
  await page.screenshot({ path: `${shots}/phone-route.png` });
  await wall.getByRole("button", { name: "Show all routes" }).click();
  assert.equal(await sheet(page), "half");
  await settle(page);
  assert.deepEqual(await outside(page), [], "the whole wall is not back");
  await close();
});

test("turning a phone keeps the whole wall in the picture", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk, PHONE);
  for (const [width, height] of [[844, 390], [390, 844], [320, 480]]) {
    await page.setViewportSize({ width, height });
    await settle(page);
    assert.deepEqual(await outside(page), [], `${width} x ${height}`);
  }
  // Once somebody has moved the camera it stays where it was put.
  const box = await page.locator("wall-topo").locator("canvas").boundingBox();
  await page.mouse.move(box.x + 150, box.y + 150);
  await page.mouse.wheel(0, -300);
  await settle(page);
  const put = await camera(page);
  await page.setViewportSize({ width: 844, height: 390 });
  await settle(page);
  assert.deepEqual(await camera(page), put);
  await close();
});

test("a lit route fades in and the camera arrives where motion is welcome", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk, { motion: true });
  const before = await camera(page);
  await page.locator("wall-topo").locator('[data-route="1"]').click();
  await settle(page);
  assert.notDeepEqual(await camera(page), before);
  assert.equal(await ask(page, (wall) => wall.stage.look.uFade.value), 1);
  await page.keyboard.press("Escape");
  await ask(page, (wall) => wall.selectRoute(null));
  await settle(page);
  const off = (await camera(page)).map((value, k) => Math.abs(value - before[k]));
  assert.ok(Math.max(...off) < 0.02, `the whole wall is not back: ${off}`);
  fine(log);
  await close();
});

test("the cursor shows what can be chosen", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  const at = await placeOf(page, 5);
  const cursor = () => ask(page, (wall) => getComputedStyle(wall.shadowRoot.querySelector("canvas")).cursor);
  await page.mouse.move(at.x, at.y);
  assert.equal(await cursor(), "pointer");
  await page.mouse.move(at.x, at.y - 60);
  assert.equal(await cursor(), "grab");
  await close();
});

test("the share button copies a link, the camera button saves a picture", async ({ browser, places: { web } }) => {
  const { page, close } = await open(browser, web);
  await page.context().grantPermissions(["clipboard-read", "clipboard-write"]);
  await tapHold(page, 5);
  const wall = page.locator("wall-topo");
  await wall.getByRole("button", { name: "Copy a link" }).click();
  await page.waitForFunction(() => /copied/.test(document.querySelector("wall-topo").shadowRoot.querySelector(".toast").textContent));
  const link = new URL(await page.evaluate(() => navigator.clipboard.readText()));
  assert.match(link.hash, /hold=5/);
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    wall.getByRole("button", { name: "Save a picture" }).click(),
  ]);
  assert.equal(download.suggestedFilename(), "wall.png");
  await close();
});

test("says what it is doing while it loads", async ({ browser, places: { web, shots } }) => {
  let pass = () => {};
  const held = new Promise((resolve) => (pass = resolve));
  const prepare = (page) =>
    page.route("**/first.glb", async (route) => {
      await held;
      await route.continue();
    });
  const { page, close } = await open(browser, web, { wait: false, prepare });
  await page.waitForFunction(() => document.querySelector("wall-topo").shadowRoot?.querySelector(".bar"));
  assert.match(await text(page, ".message"), /Test wall.*Loading the wall/);
  await page.screenshot({ path: `${shots}/loading.png` });
  pass();
  await ready(page);
  assert.equal(await ask(page, (wall) => wall.shadowRoot.querySelector(".message").hidden), true);
  await close();
});

test("the first tier and its labels are asked for once, before the viewer runs", async ({ browser, places: { web } }) => {
  const asked = [];
  const prepare = (page) => void page.on("request", (request) => asked.push(request.url()));
  const { page, log, close } = await open(browser, web, { prepare });
  const names = asked.map((url) => url.split("/").pop());
  for (const file of ["first.glb", "labels.json"]) {
    assert.equal(names.filter((name) => name === file).length, 1, `asked for ${names}`);
    const by = await page.evaluate((name) => performance.getEntriesByType("resource").find((entry) => entry.name.endsWith(name)).initiatorType, file);
    assert.equal(by, "link", file);
  }
  fine(log);
  await close();
});

test("a finer model that is missing is no error", async ({ browser, places: { web } }) => {
  const prepare = (page) => page.route("**/detail.glb", (route) => route.fulfill({ status: 404 }));
  const { page, close } = await open(browser, web, { prepare });
  await page.waitForFunction(() => /finer model did not load/.test(document.querySelector("wall-topo").shadowRoot.querySelector(".toast").textContent));
  assert.equal(await page.getAttribute("wall-topo", "data-ready"), "first");
  await tapHold(page, 5);
  assert.equal((await state(page)).hold, 5);
  await close();
});
