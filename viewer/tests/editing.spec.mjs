// What must hold of the editor.

import assert from "node:assert/strict";
import { ask, fine, graveFindings, open, placeOf, settle, tapHold, text } from "./browser.mjs";
import { editor, hold, previewed, route, under } from "./editor.mjs";
import { test } from "./fixtures.mjs";

/** Draw a finger over the picture, from a place a little to the right. */
async function draw(page, at) {
  await page.mouse.move(at.x, at.y);
  await page.mouse.down();
  await page.mouse.move(at.x + 4, at.y);
  await page.mouse.up();
  await previewed(page);
}

test("the editor speaks the reader's language, what the server says too", async ({ browser, places: { edit } }) => {
  const { page, log, close } = await editor(browser, edit, { locale: "de-AT" });
  const toast = () => text(page, ".toast");
  await ask(page, (el) => el.parts.editor.session.change({ do: "remove", hold: { id: 9999, at: [90, 0, 90] } }));
  await previewed(page);
  assert.equal(await toast(), "Änderung 1 wurde ausgelassen: Griff 9999 gibt es nicht mehr");
  await ask(page, (el) => {
    el.parts.editor.session.server.version = "another";
    return el.parts.editor.session.save();
  });
  assert.match(await toast(), /^Nicht gespeichert: inzwischen wurden andere Änderungen gespeichert/);
  assert.deepEqual(log.errors.filter((line) => !line.includes("412")), []);
  await ask(page, (el) => el.parts.editor.session.undo());
  await previewed(page);
  await close();
});

test("edits are made, undone, saved and undone after that", async ({ browser, places: { edit, shots } }) => {
  const { page, log, close, wall, press, pick, write, saved } = await editor(browser, edit);
  const check = wall.getByRole("button", { name: /^Check \d+$/ });
  const doubts = Number((await check.textContent()).split(" ")[1]);
  await check.click();
  assert.equal(await ask(page, (el) => el.selectedHold), 2, "the hold that the scan was not sure of");
  await press("Confirm");
  if (doubts === 1) await check.waitFor({ state: "hidden" });
  else await press(`Check ${doubts - 1}`);
  await ask(page, (el) => el.home());
  await settle(page);
  await tapHold(page, 5);
  const before = (await hold(page, 5)).route;
  await pick("Route", "1");
  assert.equal((await hold(page, 5)).route, 1);
  await page.keyboard.press("Control+z");
  await previewed(page);
  assert.equal((await hold(page, 5)).route, before);
  await page.keyboard.press("Control+y");
  await previewed(page);
  assert.equal((await hold(page, 5)).route, 1);
  await press("Undo");
  await press("Redo");
  await page.keyboard.press("Control+Shift+z");
  await press("Undo");
  assert.equal((await hold(page, 5)).route, before);
  await pick("Colour", "green");
  await pick("Second colour", "red");
  assert.deepEqual(await hold(page, 5).then((own) => [own.colour, own.second_colour]), ["green", "red"]);
  assert.match(await text(page, ".card"), /Green\/red/);
  await pick("Type", "crimp");
  await page.screenshot({ path: `${shots}/edit.png` });
  await press("Select several");
  await tapHold(page, 2);
  await tapHold(page, 6);
  await press("Create route");
  assert.deepEqual((await route(page, 5)).holds.toSorted(), [2, 6]);
  await wall.locator('[data-route="3"]').click();
  await write("Name", "<b>Heron</b>");
  await write("Grade", "6b");
  await write("Setter", "Anna");
  await write("Set on", "2026-03-01");
  await pick("Merge with", "4");
  assert.equal(await ask(page, (el) => el.routes.length), 4);
  const { name, grade, setter, date } = await route(page, 3);
  assert.deepEqual([name, grade, setter, date], ["<b>Heron</b>", "6b", "Anna", "2026-03-01"]);
  await press("Save");
  await saved();
  fine(log);
  await close();

  const again = await editor(browser, edit);
  assert.equal((await route(again.page, 3)).name, "<b>Heron</b>", "the page was written");
  await again.page.keyboard.press("Control+z");
  await previewed(again.page);
  assert.ok(await route(again.page, 4), "the merge of the last time is undone");
  await again.page.keyboard.press("Control+y");
  await previewed(again.page);
  assert.equal(await route(again.page, 4), null);
  fine(again.log);
  await again.close();
  const plain = await open(browser, edit.split("?")[0]);
  await ask(plain.page, (el) => el.selectRoute(3));
  assert.match(await text(plain.page, ".card"), /<b>Heron<\/b>6b · .*Anna · 1 March 2026/, "a visitor reads what the setter wrote");
  await plain.close();
});

test("each hold of a route is start, top, zone, foot or hand", async ({ browser, places: { edit, shots } }) => {
  const { page, log, close, wall, press } = await editor(browser, edit);
  const flags = () => ask(page, (el) => [...el.shadowRoot.querySelectorAll(".flag")].map((flag) => flag.textContent).sort());
  await tapHold(page, 11);
  await press("Start");
  assert.ok((await route(page, (await hold(page, 11)).route)).start.includes(11));
  await press("Zone");
  assert.deepEqual((await route(page, (await hold(page, 11)).route)).zone, [11]);
  assert.ok((await flags()).includes("Zone"));
  await page.screenshot({ path: `${shots}/edit-roles.png` });
  await press("Foot");
  assert.ok((await route(page, (await hold(page, 11)).route)).footholds.includes(11));
  await press("Hand");
  const last = await route(page, (await hold(page, 11)).route);
  for (const ids of [last.start, last.top, last.zone, last.footholds]) assert.ok(!ids.includes(11));
  assert.equal(await wall.getByRole("button", { name: "Hand", exact: true }).getAttribute("aria-pressed"), "true");
  fine(log);
  await close();
});

test("what is no hold can be taken back, from the list and on the wall", async ({ browser, places: { edit } }) => {
  const { page, log, close, wall, press } = await editor(browser, edit);
  const count = await ask(page, (el) => el.holds.length);
  const at = await placeOf(page, 9);
  await tapHold(page, 9);
  await press("Not a hold");
  assert.equal(await ask(page, (el) => el.holds.length), count - 1);
  assert.equal(await under(page, at), 0, "its surface is the wall's");
  await press("Left out 1");
  await wall.locator(".left-out button").click();
  await settle(page);
  await press("Restore as hold");
  assert.equal(await under(page, await placeOf(page, 9)), 9);
  await page.keyboard.press("Control+z");
  await previewed(page);
  assert.equal(await hold(page, 9), null);
  await ask(page, (el) => el.home());
  await settle(page);
  await page.mouse.click(at.x, at.y);
  await press("Restore as hold");
  assert.equal(await ask(page, (el) => el.selectedHold), 9);
  fine(log);
  await close();
});

test("a problem is proposed, climbed by the figure, and made a route", async ({ browser, places: { spray, shots } }) => {
  const { page, log, close, wall, press } = await editor(browser, spray);
  const card = () => text(page, ".card");
  await press("Propose");
  await wall.getByLabel("Hand moves", { exact: true }).selectOption("3");
  await wall.getByRole("button", { name: "Search", exact: true }).click();
  await wall.locator(".player").waitFor({ timeout: 120_000 });
  await settle(page);
  assert.match(await card(), /about .+ to .+, guessed from a training board/);
  assert.deepEqual(await graveFindings(page), []);
  const joints = () => ask(page, (el) => el.parts.editor.proposing.player.figure.root.children.map(({ position }) => position.toArray()).flat());
  const [began, count] = [await joints(), await ask(page, (el) => el.parts.editor.proposing.player.climber.moves.length)];
  assert.match(await text(page, ".player .note"), new RegExp(`^1/${count} · Start`));
  await wall.getByRole("button", { name: "Next move" }).click();
  assert.match(await text(page, ".player .note"), new RegExp(`^2/${count} · `));
  assert.notDeepEqual(await joints(), began, "the figure moved");
  await ask(page, (el) => el.parts.editor.proposing.player.seek(1e3));
  assert.match(await text(page, ".player .note"), new RegExp(`^${count}/${count} · `));
  const ends = await ask(page, (el) => {
    const { tables, climber } = el.parts.editor.proposing.player;
    return climber.moves.at(-1).holds.slice(0, 2).map((id) => tables.holds.get(id).id);
  });
  const shown = await ask(page, (el) => el.parts.editor.preview);
  assert.ok(ends.every((id) => shown.top.includes(id)), "both hands are on the top");
  await page.screenshot({ path: `${shots}/edit-propose.png` });
  const before = await ask(page, (el) => el.routes.map(({ id, holds }) => [id, holds]));
  await press("Create route");
  const made = await ask(page, (el) => el.routes.find(({ proposed }) => proposed));
  assert.deepEqual(made.holds.toSorted(), shown.holds.toSorted());
  assert.deepEqual([made.start.toSorted(), made.top], [shown.start.toSorted(), shown.top]);
  assert.equal(await ask(page, (el) => el.selectedRoute), made.id);
  for (const [id, holds] of before) assert.deepEqual((await route(page, id)).holds, holds, "the others keep theirs");
  assert.equal(await ask(page, (el) => el.parts.editor.preview), null);
  await wall.getByRole("button", { name: "One grade easier", exact: true }).click();
  await page.waitForFunction(
    () => /Now about|No hold nearby|no sequence to its top/.test(document.querySelector("wall-topo").shadowRoot.querySelector(".card").textContent),
    null,
    { timeout: 60_000 },
  );
  await press("Close");
  await ask(page, (el, id) => el.selectRoute(id), made.id);
  await press("Discard proposal");
  assert.equal(await ask(page, (el) => el.routes.some(({ proposed }) => proposed)), false);
  fine(log);
  await close();
});

test("the brush gives surface to a hold and to the wall", async ({ browser, places: { edit } }) => {
  const { page, log, close, press } = await editor(browser, edit);
  await tapHold(page, 7);
  const at = await ask(page, (el) => {
    const box = el.shadowRoot.querySelector("canvas").getBoundingClientRect();
    const { position, size_m } = el.holds.find(({ id }) => id === 7);
    const place = el.project([position[0], 0, position[2] + 0.5 * size_m + 0.06]);
    return { x: box.left + place.x, y: box.top + place.y };
  });
  assert.equal(await under(page, at), 0, "beside the hold is the wall");
  await press("Paint");
  await ask(page, (el) => {
    const brush = el.shadowRoot.querySelector(".edit input");
    brush.value = 8;
    brush.dispatchEvent(new Event("input"));
  });
  await draw(page, at);
  assert.equal(await under(page, at), 7, "what was painted is the hold's");
  await press("Erase");
  await draw(page, at);
  assert.equal(await under(page, at), 0, "what was erased is the wall's");
  await press("Undo");
  assert.equal(await under(page, at), 7);
  await press("Undo");
  assert.equal(await under(page, at), 0);
  assert.equal(await ask(page, (el) => el.stage.strokes.children.length), 0, "no ball is left over the wall");
  fine(log);
  await close();
});

test("the brush hides a place, and a tap shows it again", async ({ browser, places: { edit, shots } }) => {
  const { page, log, close, press } = await editor(browser, edit);
  const hidden = () => ask(page, (el) => el.parts.editor.session.result.hidden);
  const balls = () => ask(page, (el) => el.stage.strokes.children.length);
  const at = await ask(page, (el) => {
    const box = el.shadowRoot.querySelector("canvas").getBoundingClientRect();
    const { position, size_m } = el.holds.find(({ id }) => id === 7);
    const place = el.project([position[0], 0, position[2] + 0.5 * size_m + 0.06]);
    return { x: box.left + place.x, y: box.top + place.y };
  });
  await press("Hide");
  assert.match(await text(page, ".edit + *, .toast"), /./);
  await draw(page, at);
  const places = await hidden();
  assert.ok(places.length >= 1);
  assert.deepEqual([...new Set(places.map(({ radius_m }) => radius_m))], [0.15]);
  assert.equal(await balls(), places.length, "what is hidden stays marked");
  await page.screenshot({ path: `${shots}/edit-hide.png` });
  await page.mouse.click(at.x, at.y);
  await previewed(page);
  assert.deepEqual(await hidden(), [], "a tap shows the whole stroke again");
  assert.equal(await balls(), 0);
  await press("Undo");
  assert.equal((await hidden()).length, places.length);
  await press("Undo");
  assert.deepEqual(await hidden(), [], "a stroke is undone as one");
  fine(log);
  await close();
});

test("a hold is cut in two, and joined again", async ({ browser, places: { edit } }) => {
  const { page, log, close, press } = await editor(browser, edit);
  const count = () => ask(page, (el) => el.holds.length);
  const before = await count();
  const [x, , z] = (await hold(page, 4)).position;
  const drawn = (dx) =>
    ask(page, (el, place) => {
      const box = el.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const at = el.project(place);
      return { x: box.left + at.x, y: box.top + at.y };
    }, [x + dx, -0.05, z]);
  const [left, right] = [await drawn(-0.1), await drawn(0.1)];
  await tapHold(page, 4);
  await press("Split");
  for (const at of [left, right]) {
    await page.mouse.click(at.x, at.y);
    await previewed(page);
  }
  assert.equal(await count(), before + 1);
  const parts = [await drawn(0)].map(({ x: px, y }) => [{ x: px, y: y - 12 }, { x: px, y: y + 12 }])[0];
  const ids = [await under(page, parts[0]), await under(page, parts[1])];
  assert.ok(ids.includes(4) && ids[0] !== ids[1] && ids[0] > 0 && ids[1] > 0, `above ${ids[0]}, below ${ids[1]}`);
  await press("Select several");
  for (const at of parts) await page.mouse.click(at.x, at.y);
  await press("Merge into one hold");
  assert.equal(await count(), before);
  assert.equal(await under(page, parts[0]), await under(page, parts[1]));
  fine(log);
  await close();
});

test("the editor is for fingers, keys and screen readers too", async ({ browser, places: { edit, shots } }) => {
  const { page, log, close, press } = await editor(browser, edit, { width: 390, height: 844, phone: true, locale: "de-DE" });
  await ask(page, (el) => el.selectHold(5));
  await settle(page);
  await page.screenshot({ path: `${shots}/edit-phone.png` });
  assert.deepEqual(await graveFindings(page), []);
  const low = await ask(page, (el) =>
    [...el.shadowRoot.querySelectorAll(".edit button, .card button, .card select, .card input, .card summary")]
      .filter((control) => control.checkVisibility() && control.getBoundingClientRect().height < 40)
      .map((control) => control.outerHTML),
  );
  assert.deepEqual(low, [], "too low for a finger");
  // Tab leads through the bar and out of it, and a mode can be left with the key that chose it.
  await page.locator("wall-topo").getByRole("button", { name: "Mehrere auswählen" }).focus();
  await page.keyboard.press("Enter");
  assert.match(await text(page, ".card"), /0 Griffe markiert/);
  await page.keyboard.press("Enter");
  const seen = new Set();
  for (let k = 0; k < 60; k++) {
    await page.keyboard.press("Tab");
    seen.add(await ask(page, (el) => el.shadowRoot.activeElement?.closest(".edit, .card, .side, .tools")?.className ?? "outside"));
  }
  assert.ok(seen.has("outside") && [...seen].some((place) => place.startsWith("side")), `Tab stays in ${[...seen]}`);
  await press("Malen");
  assert.match(await text(page, ".toast"), /Wähle zuerst den Griff/);
  fine(log);
  await close();
});

test("of two tabs, the second to save is warned", async ({ browser, places: { edit } }) => {
  const tabs = [await editor(browser, edit), await editor(browser, edit)];
  for (const [k, { page, pick, press }] of tabs.entries()) {
    await tapHold(page, 12);
    await pick("Type", ["sloper", "pinch"][k]);
    await press("Save");
    if (k === 0) await tabs[0].saved();
  }
  await tabs[1].page.waitForFunction(() =>
    document.querySelector("wall-topo").shadowRoot.querySelector(".toast").textContent.includes("Not saved: other edits were saved"),
  );
  const again = await editor(browser, edit);
  assert.equal((await hold(again.page, 12)).type, "sloper", "the first is kept");
  for (const tab of [...tabs, again]) await tab.close();
});

test("a link that is shared does not give the right to save", async ({ browser, places: { edit } }) => {
  const { page, close } = await open(browser, edit);
  assert.match(edit, /token=/);
  assert.doesNotMatch(await ask(page, (wall) => wall.link()), /token/);
  await close();
  const plain = await open(browser, edit.split("?")[0]);
  assert.equal(await plain.page.locator("wall-topo").getByRole("button", { name: "Save", exact: true }).count(), 0);
  await plain.close();
});
