// A climber between two tries: finds, ticks, rates; without reception too.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { answered, counted, grave, OFFLINE, signIn, tooWide, until, visit, wallDrawn } from "./place.mjs";

/** One's ascents as the server has them. */
async function arrived(page) {
  const result = await page.evaluate(() => fetch("/api/v1/me/ascents?size=200", { cache: "no-store" }).then((answer) => answer.json()));
  return result.items;
}

/** A member in the gym, whose browser has what it needs without reception. */
async function member(browser, places) {
  const climber = await visit(browser, places);
  // A busy server: the first one of each of these requests fails and must be repeated.
  await climber.context.addInitScript(() => {
    const real = window.fetch;
    const failed = new Set();
    window.fetch = (input, init) => {
      const address = String(input);
      if (init?.priority !== "low" || !/published$|logbook$/.test(address) || failed.has(address)) return real(input, init);
      failed.add(address);
      return Promise.resolve(new Response("", { status: 503 }));
    };
  });
  await signIn(climber, places, places.owner); // a person without ascents in the other checks
  await climber.go(`/g/${places.gym}`);
  const kept = () => climber.page.evaluate(async () => {
    const lists = await Promise.all((await caches.keys()).map(async (name) => (await caches.open(name)).keys()));
    return lists.flat().map(({ url }) => new URL(url).pathname).join(" ");
  });
  const wanted = [/\/page\/first\.glb/, /\/page\/labels\.json/, /\/published/, /\/logbook/, /\/assets\/viewer-/];
  let names = "";
  await until(async () => {
    names = await kept();
    return wanted.every((one) => one.test(names));
  }).catch(() => assert.fail(`not kept: ${wanted.filter((one) => !one.test(names))}`));
  return climber;
}

/**
 * A server that misbehaves for ascents: `fault(id)` gives the number of copies that reach it, and the status that is
 * answered instead (0: its own; without a copy and a status below 500: a refusal). Playwright's own interception crashes
 * pages that a service worker opens.
 */
async function faulty(context, fault) {
  await context.exposeFunction("fault", fault);
  await context.addInitScript(() => {
    const real = window.fetch;
    // The browser's own Background Sync would bypass this.
    if ("SyncManager" in window) SyncManager.prototype.register = () => Promise.reject(new Error("not here"));
    window.fetch = async (input, init) => {
      if (init?.method !== "PUT" || !String(input).includes("/ascents/")) return real(input, init);
      const { copies, status, isLate } = await window.fault(String(input).split("/").at(-1));
      const answers = await Promise.all(Array.from({ length: copies }, () => real(input, init)));
      if (isLate) await new Promise((resolve) => setTimeout(resolve, 1500));
      if (status === 0) return answers.at(-1);
      if (status === 500 && copies === 0) throw new TypeError("no reception");
      const title = "this gym has banned you";
      return new Response(status === 500 ? "" : JSON.stringify({ title }), { status });
    };
  });
}

const tap = (page, kind) => page.getByRole("group", { name: "Log an ascent" }).getByRole("button", { name: kind }).click();

test("finds, ticks and says what they think", async ({ browser, places }) => {
  const { page, go, shot, close } = await member(browser, places);
  const rows = page.locator("main .routes li a, main .about li a");
  await rows.first().waitFor();
  const all = await rows.count();
  assert.ok(all > 0);
  assert.deepEqual(await grave(page), []);
  await go(`/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(page);
  await rows.first().click();
  await page.getByRole("heading", { level: 2 }).waitFor();
  const name = await page.locator("#route-name").textContent();
  await tap(page, "Try");
  await page.getByText("Try logged").waitFor();
  await tap(page, "Top");
  await page.getByText("Top logged").waitFor();
  // A try and the top after it are one line, of two tries.
  await page.getByText("2 tries").waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByText("· one try").waitFor();
  await tap(page, "Top");
  await page.getByText("2 tries").waitFor();
  assert.equal(await page.getByRole("button", { name: "Flash" }).isDisabled(), true);
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByLabel("Private note").fill("Left foot high");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("Left foot high").waitFor();
  await page.getByRole("radio", { name: "4 stars" }).check({ force: true });
  await page.getByRole("button", { name: "Keep it" }).click();
  await page.getByText("Saved.").waitFor();
  assert.deepEqual(await grave(page), []);
  await shot("tick");
  await page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
  assert.ok((await tooWide(page)) <= 0);
  await shot("tick-twice");
  await page.evaluate(() => document.documentElement.style.removeProperty("font-size"));
  await until(async () => (await arrived(page))[0]?.note !== "" && (await arrived(page)).length === 1);
  assert.deepEqual((await arrived(page)).map(({ kind, tries, note }) => [kind, tries, note]), [["top", 2, "Left foot high"]]);
  // Unclimbed routes: in the list, and on the wall.
  await page.getByRole("link", { name: "All routes" }).click();
  await page.getByRole("button", { name: "To do" }).click();
  await counted(rows, all - 1);
  await counted(rows.filter({ hasText: name }), 0);
  await shot("to-do");
  await page.getByRole("button", { name: "Clear filters" }).click();
  // A withdrawn ascent stays withdrawn.
  await rows.filter({ hasText: name }).click();
  await page.getByRole("button", { name: "Edit", exact: true }).click();
  await page.getByRole("button", { name: "Delete" }).click();
  await until(async () => (await arrived(page)).length === 0);
  await close();
});

test("ten ticks without reception arrive once each, whatever the server answers", async ({ browser, places }) => {
  const climber = await member(browser, places);
  const { context, expected } = climber;
  let { page } = climber;
  const before = new Set((await arrived(page)).map(({ id }) => id));
  // Each is accepted, but the first answer is 500 or none; then it is sent twice at once; one answer is late.
  const requested = new Map();
  await faulty(context, async (id) => {
    const turn = (requested.get(id) ?? 0) + 1;
    requested.set(id, turn);
    const isLate = requested.size === 4;
    if (turn === 1) return { copies: requested.size % 3 === 0 ? 0 : 1, status: 500, isLate };
    return { copies: turn === 2 ? 2 : 1, status: 0, isLate };
  });
  await context.setOffline(true);
  await page.goto(`${places.address}/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(page);
  await page.getByText("Offline since").waitFor();
  await page.locator("main .about li a").first().click();
  for (let number = 1; number <= 10; number++) {
    await tap(page, number % 2 ? "Zone" : "Top");
    await page.waitForFunction((wanted) => document.querySelectorAll("article li .chip").length >= wanted, number);
  }
  await climber.shot("offline");
  await page.getByRole("link", { name: "10 changes waiting to sync" }).click();
  assert.deepEqual(await grave(page), []);
  await page.close();

  await context.setOffline(false);
  page = await context.newPage();
  const other = await context.newPage();
  await Promise.all([page, other].map((each) => each.goto(`${places.address}/me/waiting`)));
  const settled = page.getByText("Everything is synced.");
  for (let turn = 0; turn < 40 && !(await settled.isVisible()); turn++) {
    await page.evaluate(() => dispatchEvent(new Event("online")));
    await page.waitForTimeout(250);
  }
  await settled.waitFor();
  await other.getByText("Everything is synced.").waitFor();
  assert.equal(requested.size, 10);
  // With two tabs open, no more copies were sent than the answers required.
  assert.ok([...requested.values()].every((turns) => turns >= 2), JSON.stringify([...requested.values()]));
  const ids = (await arrived(page)).map(({ id }) => id).filter((id) => !before.has(id));
  assert.deepEqual([...ids].sort(), [...requested.keys()].sort());
  expected(OFFLINE);
  await climber.close();
});

test("what the server refuses is kept and shown", async ({ browser, places }) => {
  const climber = await member(browser, places);
  const { page, context, expected } = climber;
  const before = (await arrived(page)).length;
  let isExcluded = true;
  await faulty(context, async () => (isExcluded ? { copies: 0, status: 403, isLate: false } : { copies: 1, status: 0, isLate: false }));
  await climber.go(`/g/${places.gym}/w/${places.wall}`);
  await page.locator("main .about li a").first().click();
  await tap(page, "Zone");
  await page.getByRole("link", { name: "1 change was rejected" }).click();
  await page.getByText("this gym has banned you").waitFor();
  assert.deepEqual(await grave(page), []);
  isExcluded = false;
  await page.getByRole("button", { name: "Try again" }).click();
  await page.getByText("Everything is synced.").waitFor();
  assert.equal((await arrived(page)).length, before + 1);
  expected(answered(403), OFFLINE);
  await climber.close();
});

test("what is logged without an account stays on the device, and moves into one", async ({ browser, places }) => {
  const guest = await visit(browser, places);
  const { page, go, shot } = guest;
  const wall = `/g/${places.gym}/w/${places.wall}`;
  await go(wall);
  await page.locator("main .about li a").first().click();
  await page.getByText("Stays on this device only.").waitFor();
  await tap(page, "Try");
  await tap(page, "Top");
  await tap(page, "Project");
  await page.getByText("My ascents").scrollIntoViewIfNeeded();
  assert.deepEqual(await grave(page), []);
  assert.ok((await tooWide(page)) <= 0);
  await shot("guest-ascent");
  // A project that is taken back is gone at once; the rest is here after a reload.
  const chips = page.locator("article li .chip");
  await counted(chips, 2);
  await tap(page, "Project");
  await counted(chips, 1);
  await page.reload();
  await counted(chips, 1);

  // Signing in takes nothing over by itself: the device may be somebody else's.
  await go("/sign-in");
  await page.getByText("1 ascent on this device has no account").waitFor();
  await shot("guest-sign-in");
  await signIn(guest, places, places.owner);
  const before = (await arrived(page)).length;
  await page.getByRole("link", { name: "1 ascent on this device has no account" }).click();
  await page.getByRole("heading", { name: "On this device" }).waitFor();
  assert.deepEqual(await grave(page), []);
  await shot("guest-takes-over");
  assert.equal((await arrived(page)).length, before);
  await page.getByRole("button", { name: "Add to my account" }).click();
  await until(async () => (await arrived(page)).length === before + 1);
  const [{ kind, tries }] = await arrived(page);
  assert.deepEqual([kind, tries], ["top", 2]);
  await page.getByText("Everything is synced.").waitFor();
  await guest.close();
});
