// Colours that look alike, more contrast, colours of the system, and text at twice the size.

import assert from "node:assert/strict";
import { ask, fine, graveFindings, LAUNCH, open, placeOf, settle } from "./browser.mjs";
import { editor } from "./editor.mjs";
import { test } from "./fixtures.mjs";

const PHONE = { width: 390, height: 844, phone: true };
const LAPTOP = { width: 1280, height: 800 };

/** CSS backgrounds of the routes' swatches, by colour. */
const backgrounds = (page) =>
  ask(page, (wall) => {
    const rows = [...wall.shadowRoot.querySelectorAll("[data-route]")];
    const colourOf = (row) => wall.routes.find(({ id }) => id === Number(row.dataset.route)).colour;
    return Object.fromEntries(rows.map((row) => [colourOf(row), getComputedStyle(row.querySelector(".swatch")).backgroundImage]));
  });

/** Names of routes that are drawn on the wall. */
const names = (page) =>
  ask(page, (wall) =>
    [...wall.shadowRoot.querySelectorAll(".route-name")].filter(({ style }) => style.visibility === "visible").map(({ textContent }) => textContent),
  );

test("colours that look alike are told apart", async ({ browser, places: { disk, shots } }) => {
  const { page, log, close } = await open(browser, disk, LAPTOP);
  const choice = page.locator("wall-topo").getByLabel("Colour vision");
  const before = await backgrounds(page);
  assert.ok(Object.values(before).every((image) => image === "none"));
  assert.deepEqual(await names(page), []);
  const colours = Object.keys(before);
  await choice.selectOption("deutan");
  await settle(page);
  const deutan = await backgrounds(page);
  assert.ok(["red", "green"].every((colour) => colours.includes(colour)), `the wall has ${colours}`);
  assert.notEqual(deutan.red, deutan.green, "red and green look alike and have the same pattern");
  const named = await ask(page, (wall) => wall.routes.filter(({ colour }) => colour === "red" || colour === "green").length);
  const shown = await names(page);
  assert.equal(shown.length, named);
  assert.ok(shown.every((name) => /^(Red|Green) \d$/.test(name)), String(shown));
  assert.deepEqual(await graveFindings(page), []);
  await page.screenshot({ path: `${shots}/deutan.png` });
  // They give way to the selected route, and the choice is kept.
  await ask(page, (wall) => wall.selectRoute(1));
  assert.deepEqual(await names(page), []);
  await page.reload();
  await page.waitForSelector("wall-topo[data-ready]");
  assert.deepEqual(await backgrounds(page), deutan);
  await page.locator("wall-topo").getByLabel("Colour vision").selectOption("");
  assert.deepEqual(await backgrounds(page), before);
  fine(log);
  await close();
});

test("more contrast, and the system's own colours", async ({ browser, places: { disk, shots } }) => {
  for (const dark of [false, true]) {
    const { page, close } = await open(browser, disk, { ...LAPTOP, dark, contrast: "more" });
    await ask(page, (wall) => wall.selectHold(5));
    await settle(page);
    assert.deepEqual(await graveFindings(page, ["color-contrast-enhanced"]), []);
    await page.screenshot({ path: `${shots}/contrast-${dark ? "dark" : "light"}.png` });
    await close();
  }
  const { page, close } = await open(browser, disk, { ...LAPTOP, dark: true, forcedColors: "active" });
  await ask(page, (wall) => wall.selectRoute(1));
  await settle(page);
  const outline = await ask(page, (wall) => getComputedStyle(wall.shadowRoot.querySelector("[data-route='1']")).outlineStyle);
  assert.equal(outline, "solid", "the selected route is told by its colour alone");
  await page.screenshot({ path: `${shots}/forced-colours.png` });
  await close();
});

/** Text that is cut off: an element that may not be scrolled is smaller than what is in it. */
const cutOff = (page) =>
  ask(page, (wall) =>
    [...wall.shadowRoot.querySelectorAll("button, select, h2, h3, dd, summary")]
      .filter((one) => one.checkVisibility({ visibilityProperty: true }) && !one.closest(".placeholder, .hush"))
      .filter((one) => one.scrollHeight > one.clientHeight + 2 && getComputedStyle(one).overflowY === "hidden")
      .map((one) => one.textContent || one.className),
  );

/** Whether a screenshot of the page is blue around a place, as hold 5 is. */
const isBlue = (page, shot, at) =>
  page.evaluate(
    async ([data, { x, y }]) => {
      const picture = await createImageBitmap(new Blob([Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0))]));
      const pen = new OffscreenCanvas(picture.width, picture.height).getContext("2d");
      pen.drawImage(picture, 0, 0);
      const [red, , blue] = pen.getImageData(x, y, 1, 1).data;
      return blue > red + 60;
    },
    [shot.toString("base64"), at],
  );

test("text at twice the size", async ({ playwright, places: { disk, edit, shots } }) => {
  const args = [...LAUNCH.args, "--blink-settings=defaultFontSize=32"];
  const browser = await playwright.chromium.launch({ ...LAUNCH, args });
  for (const [name, size] of Object.entries({ phone: PHONE, laptop: LAPTOP })) {
    for (const where of ["wall", "edit"]) {
      const { page, log, close } = where === "wall" ? await open(browser, disk, size) : await editor(browser, edit, size);
      assert.equal(await ask(page, (wall) => getComputedStyle(wall.shadowRoot.querySelector(".shell")).fontSize), "30px");
      await ask(page, (wall) => wall.selectHold(5));
      await settle(page);
      const shot = await page.screenshot({ path: `${shots}/large-${where}-${name}.png` });
      const hold = await placeOf(page, 5);
      assert.ok(await isBlue(page, shot, hold), `${where}, ${name}: the selected hold is not seen`);
      const width = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(width <= size.width, `${where}, ${name}: ${width} px wide`);
      assert.deepEqual(await cutOff(page), [], `${where}, ${name}`);
      // The card may be scrolled; the wall stays to be seen above it.
      const free = await ask(page, (wall) => {
        const [canvas, card] = ["canvas", ".card"].map((part) => wall.shadowRoot.querySelector(part).getBoundingClientRect());
        const covered = Math.max(0, Math.min(canvas.right, card.right) - Math.max(canvas.left, card.left)) * Math.max(0, canvas.bottom - card.top);
        return (canvas.width * canvas.height - covered) / (innerWidth * innerHeight);
      });
      assert.ok(free > 0.25, `${where}, ${name}: ${free.toFixed(2)} of the screen is left for the wall`);
      fine(log);
      await close();
    }
  }
  await browser.close();
});
