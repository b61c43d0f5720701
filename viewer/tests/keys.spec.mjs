// The wall by keys alone, and as a screen reader has it: its accessibility tree.

import assert from "node:assert/strict";
import { ask, fine, graveFindings, open, settle, state } from "./browser.mjs";
import { editor, previewed } from "./editor.mjs";
import { test } from "./fixtures.mjs";

const heard = (page) => ask(page, (wall) => wall.shadowRoot.querySelector(".toast").textContent);
const focusPicture = (page) => ask(page, (wall) => wall.shadowRoot.querySelector("canvas").focus());
const focused = (page) =>
  ask(page, (wall) => {
    const { activeElement } = wall.shadowRoot;
    return activeElement?.getAttribute("aria-label") ?? activeElement?.textContent ?? null;
  });

/** Holds with the outline of the cursor. */
const outlined = (page) =>
  ask(page, (wall) => {
    const { state } = wall.stage;
    return wall.holds.map(({ id }) => id).filter((id) => state.data[4 * id + 1] === 4);
  });

/** Press Tab until the focus is on what has this name. */
async function tabTo(page, name) {
  for (let k = 0; k < 60; k++) {
    await page.keyboard.press("Tab");
    if (name.test((await focused(page)) ?? "")) return;
  }
  assert.fail(`${name} cannot be reached by Tab`);
}

test("a list follows the wall", async ({ browser, places: { disk, shots } }) => {
  const { page, log, close } = await open(browser, disk);
  const [first] = await ask(page, (wall) => wall.routes);
  await tabTo(page, new RegExp(`${first.id}.*holds`));
  assert.deepEqual((await outlined(page)).toSorted(), first.holds.toSorted(), "the wall does not show the focused route");
  await page.keyboard.press("Enter");
  await tabTo(page, /^Holds in order$/);
  assert.deepEqual(await outlined(page), []);
  await page.keyboard.press("Enter");
  await page.keyboard.press("Tab");
  assert.deepEqual(await outlined(page), first.holds.slice(0, 1));
  await page.keyboard.press("ArrowDown");
  assert.deepEqual(await outlined(page), first.holds.slice(1, 2));
  await settle(page);
  await page.screenshot({ path: `${shots}/holds-in-order.png` });
  const tree = await page.locator("wall-topo").ariaSnapshot();
  const rows = tree.split("\n").filter((line) => /button ".*, \d+([.]\d)? c?m"/.test(line));
  assert.equal(rows.length, first.holds.length, tree);
  assert.match(rows[0], /, Start, /);
  assert.match(rows.at(-1), /, Top, /);
  assert.deepEqual(await graveFindings(page), []);
  await page.keyboard.press("End");
  await page.keyboard.press("Enter");
  assert.deepEqual(await state(page), { route: first.id, hold: first.holds.at(-1) });
  const words = await ask(page, (wall, id) => wall.describeHold(id), first.holds.at(-1));
  // Its card has the focus, and gives it back to its row.
  assert.ok(words.startsWith(await focused(page)), `${words} is not ${await focused(page)}`);
  await tabTo(page, /^Back to the route$/);
  await page.keyboard.press("Enter");
  assert.equal(await focused(page), words);
  await page.keyboard.press("Escape");
  assert.equal(await ask(page, (wall) => wall.shadowRoot.activeElement.tagName), "CANVAS");
  fine(log);
  await close();
});

test("a screen reader finds list, picture, tools and card", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  await ask(page, (wall) => wall.selectHold(5));
  const tree = await page.locator("wall-topo").ariaSnapshot();
  const [route, hold] = await ask(page, (wall) => [wall.routes.length, wall.describeHold(5)]);
  for (const part of [/complementary "Routes"/, /img "The wall in 3D/, /toolbar "View"/, /region "Selected"/, /status/]) assert.match(tree, part);
  assert.equal(tree.match(/button ".*holds/g).length, route);
  assert.ok(tree.includes(`heading "${hold.split(", ")[0]}"`), tree);
  await close();
});

test("a length is measured by keys", async ({ browser, places: { disk, shots } }) => {
  const { page, log, close } = await open(browser, disk);
  await focusPicture(page);
  await page.keyboard.press("m");
  await page.keyboard.press("Enter"); // the crosshair appears
  const [from] = [await heard(page)];
  assert.match(from, /, \d+([.]\d)? c?m$/);
  await page.keyboard.press("Enter");
  for (let k = 0; k < 8; k++) await page.keyboard.press("Shift+ArrowRight");
  await page.screenshot({ path: `${shots}/crosshair.png` });
  await page.keyboard.press("Enter");
  assert.match(await heard(page), /^[\d.]+ m$/);
  await page.keyboard.press("Escape");
  assert.equal(await ask(page, (wall) => wall.measuring), false);
  fine(log);
  await close();
});

test("the wall is edited by keys alone", async ({ browser, places: { edit, shots } }) => {
  const { page, log, close } = await editor(browser, edit);
  const holds = () => ask(page, (wall) => wall.holds.length);
  const before = await holds();
  await focusPicture(page);
  // A hold of a route is made its zone.
  for (let k = 0; k < 30; k++) {
    await page.keyboard.press(k % 2 ? "Shift+ArrowRight" : "Shift+ArrowUp");
    await page.keyboard.press("Enter");
    const { hold, route } = await state(page);
    if (hold !== null && route !== null) break;
  }
  const { hold, route } = await state(page);
  await page.keyboard.press("Enter");
  await tabTo(page, /^Zone$/);
  await page.keyboard.press("Enter");
  await previewed(page);
  assert.equal(await focused(page), "Zone", "the focus is lost with the answer");
  const zone = () => ask(page, (wall, id) => wall.routes.find((one) => one.id === id).zone ?? [], route);
  assert.ok((await zone()).includes(hold));
  await page.keyboard.press("Control+z");
  await previewed(page);
  assert.ok(!(await zone()).includes(hold));
  // A hold is added where the crosshair is.
  await page.keyboard.press("Escape");
  await tabTo(page, /^Add a hold$/);
  await page.keyboard.press("Enter");
  assert.equal(await ask(page, (wall) => wall.shadowRoot.activeElement.tagName), "CANVAS");
  await page.keyboard.press("Shift+ArrowDown");
  for (let k = 0; k < 60 && !(await heard(page)).startsWith("Wall, "); k++) await page.keyboard.press("Shift+ArrowDown");
  await page.screenshot({ path: `${shots}/edit-crosshair.png` });
  await page.keyboard.press("Enter");
  await previewed(page);
  const after = await holds();
  // A place without relief grows to no hold; the editor says so and takes the step back.
  if (after === before) assert.match(await heard(page), /was skipped/);
  else await page.keyboard.press("Control+z");
  await previewed(page);
  assert.equal(await holds(), before);
  fine(log);
  await close();
});

test("paint is laid by keys", async ({ browser, places: { edit } }) => {
  const { page, log, close } = await editor(browser, edit);
  const picture = await ask(page, (wall) => wall.shadowRoot.querySelector("canvas").getAttribute("aria-label"));
  await ask(page, (wall) => wall.selectHold(5));
  await tabTo(page, /^Paint$/);
  await page.keyboard.press("Enter");
  await tabTo(page, /^Brush/);
  await page.keyboard.press("End"); // the test's wall has few triangles
  for (let k = 0; k < 30 && (await focused(page)) !== picture; k++) await page.keyboard.press("Shift+Tab");
  await page.keyboard.press("Enter"); // the crosshair appears at the hold
  for (let k = 0; k < 60 && !(await heard(page)).startsWith("Wall, "); k++) await page.keyboard.press("Shift+ArrowLeft");
  assert.match(await heard(page), /^Wall, /);
  const at = await ask(page, (wall) => ({ ...wall.parts.crosshair.place }));
  await page.keyboard.press("Enter");
  await previewed(page);
  assert.equal(await ask(page, (wall, { x, y }) => wall.pickAt(x, y), at), 5);
  await page.keyboard.press("Control+z");
  await previewed(page);
  await page.keyboard.press("Escape");
  assert.equal(await ask(page, (wall) => wall.parts.editor.isAiming), false);
  fine(log);
  await close();
});
