// node tests/reset.mjs ADDRESS [x,y,z]: what setters do after a reset, by taps, on a scan that `walltopo
// view --edit` shows (a copy: it is saved). At the place, else where a hold was deleted before, a hold
// was missed. Prints the seconds that somebody waits for each of five tasks
// and for saving, from the tap to what it does being seen.

import assert from "node:assert/strict";
import { loadavg } from "node:os";
import { argv } from "node:process";
import { pathToFileURL } from "node:url";
import { ask, fine, placeOf, settle, start } from "./browser.mjs";
import { editor, previewed } from "./editor.mjs";

const routes = (page) => ask(page, (el) => el.routes);
const route = async (page, id) => (await routes(page)).find((one) => one.id === id);

/** Holds that a tap at their place chooses, as the picture stands. */
const tappable = (page) =>
  ask(page, (el) =>
    el.holds
      .filter(({ id, route: of }) => {
        const at = el.project(id);
        return of !== null && el.pickAt(at.x, at.y) === id;
      })
      .map(({ id, route: of }) => ({ id, route: of })),
  );

/** Does the five tasks and saves; gives the seconds of waiting. */
export async function reset(browser, address, missed = null) {
  const { page, log, close, wall, press, pick, write, saved } = await editor(browser, address);
  const waited = {};
  const timed = async (task, act) => {
    const began = performance.now();
    await act();
    waited[task] = Math.round((performance.now() - began) / 10) / 100 + (waited[task] ?? 0);
  };
  const tap = async ({ x, y }) => {
    await page.mouse.click(x, y);
    await previewed(page);
  };
  const all = await tappable(page);
  const of = (id) => all.filter((hold) => hold.route === id).map((hold) => hold.id);
  const [first, second, ...others] = (await routes(page)).filter(({ id }) => of(id).length > 2).map(({ id }) => id);
  const [merged, into] = [second, others[0] ?? first];

  await timed("fix a start", async () => {
    const { start: was } = await route(page, first);
    const [right] = of(first).filter((id) => !was.includes(id));
    await tap(await placeOf(page, right));
    await press("Start");
    for (const id of was.filter((one) => all.some((hold) => hold.id === one))) {
      await tap(await placeOf(page, id));
      await press("Hand");
    }
    assert.ok((await route(page, first)).start.includes(right));
  });

  const gone = of(first).at(-1);
  const there = await placeOf(page, gone);
  const most = Math.max(...(await ask(page, (el) => el.holds)).map(({ id }) => id));
  await timed("delete", async () => {
    await tap(there);
    await press("Not a hold");
    assert.ok(!(await ask(page, (el) => el.holds)).some(({ id }) => id === gone));
  });

  await timed("add a missed hold", async () => {
    const before = (await ask(page, (el) => el.holds)).length;
    await press("Add a hold");
    await tap(missed ? await placeOf(page, missed) : there);
    assert.equal((await ask(page, (el) => el.holds)).length, before + 1, "nothing was added");
    const added = await ask(page, (el) => el.selectedHold);
    assert.ok(added > most, "the new hold is not chosen");
    await pick("Route", String(first));
    assert.ok((await route(page, first)).holds.includes(added));
  });

  await timed("merge", async () => {
    await wall.locator(`[data-route="${into}"]`).click();
    await settle(page);
    await pick("Merge with", String(merged));
    assert.equal(await route(page, merged), undefined);
  });

  await timed("split and name", async () => {
    await ask(page, (el) => el.home());
    await settle(page);
    await press("Select several");
    for (const id of of(merged).slice(0, 2)) await tap(await placeOf(page, id));
    await press("Create route");
    const made = (await routes(page)).find(({ holds }) => holds.includes(of(merged)[0]));
    assert.deepEqual(made.holds.toSorted(), of(merged).slice(0, 2).toSorted());
    await wall.locator(`[data-route="${made.id}"]`).click();
    await write("Name", "New one");
    assert.equal((await route(page, made.id)).name, "New one");
  });

  await timed("save", async () => {
    await press("Save");
    await saved("Saved");
  });
  await timed("pages written", () => saved());
  fine(log);
  await close();
  return waited;
}

if (import.meta.url === pathToFileURL(argv[1]).href) {
  const browser = await start();
  try {
    const waited = await reset(browser, argv[2], argv[3]?.split(",").map(Number));
    const { "pages written": written, ...taps } = waited;
    const sum = Object.values(taps).reduce((total, seconds) => total + seconds, 0);
    const lines = Object.entries(taps).map(([task, seconds]) => `${task}: ${seconds.toFixed(1)} s\n`);
    process.stdout.write(
      `${lines.join("")}waited ${sum.toFixed(1)} s in all; pages written ${written.toFixed(1)} s later; load ${loadavg()[0].toFixed(0)}\n`,
    );
  } finally {
    await browser.close();
  }
}
