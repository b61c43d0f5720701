// The editor under a finger, on the narrowest phone in use: each edit of a reset evening, by touch alone.

import assert from "node:assert/strict";
import { ask, fine, fingers, placeOf, settle, text } from "./browser.mjs";
import { editor, hold, previewed, route as routeOf, under } from "./editor.mjs";
import { test } from "./fixtures.mjs";

const PHONE = { width: 360, height: 640, phone: true, scale: 3 };

const ids = (page) => ask(page, (wall) => wall.holds.map(({ id }) => id));
const camera = (page) => ask(page, (wall) => wall.camera);

/** Where a point of the wall is drawn; fails where something lies over it. */
async function reachable(page, place) {
  const at = await ask(
    page,
    (wall, where) => {
      const box = wall.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const { x, y } = wall.project(where);
      const top = wall.shadowRoot.elementFromPoint(box.left + x, box.top + y);
      return { x: box.left + x, y: box.top + y, under: top?.className ?? top?.tagName, canvas: top?.tagName === "CANVAS" };
    },
    place,
  );
  assert.ok(at.canvas, `${JSON.stringify(place)} lies under ${at.under} at ${at.x}, ${at.y}`);
  return at;
}

async function phone(browser, address) {
  const opened = await editor(browser, address, PHONE);
  const { page, wall } = opened;
  const tap = async (place) => {
    const { x, y } = await reachable(page, place);
    await page.touchscreen.tap(x, y);
    await settle(page);
  };
  const press = async (name) => {
    await wall.getByRole("button", { name, exact: true }).tap();
    await previewed(page);
  };
  // The list of a select is the phone's own, so its choice is made by script.
  const pick = async (label, option) => {
    const field = wall.getByLabel(label, { exact: true });
    await field.tap();
    await field.selectOption(option);
    await previewed(page);
  };
  const write = async (label, value) => {
    const field = wall.getByLabel(label, { exact: true });
    await field.tap();
    await field.fill(value);
    await field.blur();
    await previewed(page);
  };
  /** Spread two fingers at a point of the wall. */
  const zoom = async (place) => {
    const { x, y } = await reachable(page, place);
    const way = (side) => [0, 1, 2, 3].map((step) => ({ x: x + side * (30 + 15 * step), y }));
    await fingers(page, way(-1), way(1));
    await settle(page);
  };
  const home = async () => {
    await ask(page, (el) => (el.selectHold(null), el.selectRoute(null), el.home()));
    await settle(page);
  };
  return { ...opened, tap, press, pick, write, zoom, home };
}

test("twelve edits by touch on a phone of 360 pixels", async ({ browser, places: { touch, shots } }) => {
  const { page, log, close, tap, press, pick, write, zoom, home, saved } = await phone(browser, touch.address);
  const route = (id) => routeOf(page, id);

  // 1 to 4: what a hold is.
  await tap(5);
  await pick("Colour", "green");
  await pick("Type", "crimp");
  await pick("Route", "1");
  await press("Start");
  const five = await hold(page, 5);
  assert.deepEqual([five.colour, five.type, five.route], ["green", "crimp", 1]);
  assert.ok((await route(1)).start.includes(5));
  await page.screenshot({ path: `${shots}/hold.png` });

  // 5 and 6: no hold, and a hold again.
  await home();
  await tap(9);
  await press("Not a hold");
  assert.equal(await hold(page, 9), null);
  await press("Left out 1");
  await page.locator("wall-topo").locator(".left-out button").tap();
  await settle(page);
  await press("Restore as hold");
  assert.ok(await hold(page, 9));

  // 7: a hold that the scan missed.
  await home();
  const before = await ids(page);
  await press("Add a hold");
  await tap(touch.missed);
  await previewed(page);
  const [added] = (await ids(page)).filter((id) => !before.includes(id));
  assert.ok(added, "no hold was added");

  // 8: a route of several holds.
  await home();
  await press("Select several");
  await tap(2);
  await tap(6);
  assert.match(await text(page, ".card"), /2 holds selected/);
  await press("Create route");
  const made = await ask(page, (el) => el.routes.find(({ holds }) => holds.length === 2 && holds.includes(2) && holds.includes(6))?.id);
  assert.ok(made, "no route was made");

  // 9: name, grade and setter.
  await home();
  await ask(page, (el, id) => el.selectRoute(id), made);
  await write("Name", "Heron");
  await write("Grade", "6b");
  await write("Setter", "Anna");
  const named = await route(made);
  assert.deepEqual([named.name, named.grade, named.setter], ["Heron", "6b", "Anna"]);
  await page.screenshot({ path: `${shots}/route.png` });

  // 10: cut in two; 11: joined.
  await home();
  const [x, y, z] = (await hold(page, 4)).position;
  const count = (await ids(page)).length;
  await tap(4);
  await press("Split");
  await tap([x - 0.1, y, z]);
  await page.screenshot({ path: `${shots}/split.png` });
  await tap([x + 0.1, y, z]);
  await previewed(page);
  const parts = (await ids(page)).filter((id) => id === 4 || !before.includes(id)).filter((id) => id !== added);
  assert.deepEqual([(await ids(page)).length, parts.length], [count + 1, 2]);
  await home();
  await press("Select several");
  // Two taps at almost one place are a double tap.
  const apart = async () => {
    const [one, other] = [await placeOf(page, parts[0]), await placeOf(page, parts[1])];
    return Math.hypot(one.x - other.x, one.y - other.y);
  };
  for (let k = 0; k < 8 && (await apart()) < 30; k++) await zoom([x, y, z]);
  for (const id of parts) await tap((await hold(page, id)).position);
  await press("Merge into one hold");
  assert.equal((await ids(page)).length, count);

  // 12: surface by the brush; two fingers move the wall in between, and paint nothing.
  await home();
  await tap(7);
  await press("Paint");
  const { position, size_m } = await hold(page, 7);
  const beside = [position[0], 0, position[2] + 0.5 * size_m + 0.06];
  const far = await camera(page);
  const edits = () => ask(page, (el) => el.parts.editor.session.entries.length);
  const entries = await edits();
  await zoom(position);
  assert.equal(await edits(), entries, "two fingers painted");
  assert.notDeepEqual(await camera(page), far, "two fingers did not move the wall");
  const from = await reachable(page, beside);
  await page.screenshot({ path: `${shots}/paint.png` });
  const kept = await camera(page);
  await fingers(page, [from, { x: from.x + 6, y: from.y }]);
  await previewed(page);
  assert.deepEqual(await camera(page), kept, "one finger moved the wall");
  assert.ok((await edits()) > entries, "one finger painted nothing");
  assert.equal(await under(page, from), 7);

  await press("Undo");
  assert.equal(await edits(), entries);
  await press("Redo");
  await press("Save");
  await saved();
  fine(log);
  await close();
});
