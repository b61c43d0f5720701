// A climber and a setter on bad networks; `build/gym-shots/network-*.json` has the seconds that each step took.

import assert from "node:assert/strict";
import { readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { button, saying, until } from "./driver.mjs";
import { test } from "./fixtures.mjs";

const ROUTE = "//main//li//a[contains(., 'Moon')]";
const TOP = "//main//*[@role='group' and @aria-label='Log an ascent']//button[contains(., 'Top')]";

const result = (page, path) => page.evaluate((address) => fetch(address, { cache: "no-store" }).then((answer) => answer.json()), `/api/v1${path}`);
const ascents = async (page) => (await result(page, "/me/ascents?size=200")).items.length;

/** Seconds from the call of `act` to its end. */
async function seconds(act) {
  const begin = Date.now();
  await act();
  return Math.round((Date.now() - begin) / 100) / 10;
}

async function seeWall(page, places) {
  await page.go(`/g/${places.gym}/w/${places.wall}`);
  await page.find("//wall-topo[@data-ready='first' or @data-ready='detail']");
}

async function tick(page, broken) {
  await page.click(ROUTE);
  await page.find(TOP);
  const before = await ascents(page);
  const restarted = broken();
  await page.click(TOP);
  await page.find(`${saying("Top logged")} | ${saying("waiting to sync")}`); // the page says at once that it has it
  await restarted;
  await until(async () => (await ascents(page).catch(() => before)) === before + 1, "the tick is on the server");
}

async function sendPhotos(page, places, broken) {
  await page.go(`/g/${places.gym}/w/${places.wall}/versions`);
  await page.click(button("New scan"));
  const photos = readdirSync(places.photos).sort().slice(0, 4).map((name) => join(places.photos, name));
  await page.choose("//main//input[@type='file']", photos);
  await broken();
  await page.says("4 usable photos");
}

async function watchBoard(page, places, broken, n) {
  const { id, entry, problem } = places.competition;
  await page.go(`/g/${places.gym}/competitions/${id}/board`);
  await page.says("Anna Roth");
  await broken();
  await until(() => page.evaluate(async (address, entry_id, problem_id, n) => {
    const now = new Date().toISOString();
    const event = { entry_id, problem_id, kind: "top", n, device: "check", number: 1, made_at: now, sent_at: now };
    const headers = { "content-type": "application/json" };
    return (await fetch(`${address}/${crypto.randomUUID()}`, { method: "PUT", headers, body: JSON.stringify(event) })).ok;
  }, `/api/v1/gyms/${places.gym}/competitions/${id}/events`, entry, problem, n), "a judge enters a top");
  const shown = await seconds(() => page.find("//tr[contains(., 'Anna Roth') and contains(., '120')]"));
  return { shown, live: await page.evaluate(() => document.querySelector("[data-live]").dataset.live === "true") };
}

const nothing = () => Promise.resolve();
const NETWORKS = {
  "3G": { mode: "slow" },
  "a proxy that holds streams back": { mode: "buffering" },
  "IPv6 alone": { mode: "open", host: "::1" },
  "a server that restarts": { mode: "open", restarts: true },
};

for (const [name, { mode, host, restarts }] of Object.entries(NETWORKS)) {
  test(name, async ({ page, places, network }) => {
    if (host) {
      await network.close();
      await network.listen(places, host);
    }
    network.set(mode);
    const broken = restarts ? () => fetch(places.restart, { method: "POST" }) : nothing;
    const times = {};
    times.wall = await seconds(() => seeWall(page, places));
    times.tick = await seconds(() => tick(page, broken));
    times.photos = await seconds(() => sendPhotos(page, places, broken));
    const board = await watchBoard(page, places, broken, 1);
    writeFileSync(join(places.shots, `network-${name.replace(/\W+/g, "-")}.json`), JSON.stringify({ ...times, board }));
    if (restarts) await page.find("//*[@data-live='true']"); // again
    else assert.equal(board.live, mode !== "buffering", "live or polled");
    assert.ok(board.shown < 15, `the board showed a score after ${board.shown} s`);
  });
}
