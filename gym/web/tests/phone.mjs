// node phone.mjs PLACES.json: load times of a gym and a wall on a slow phone, and findings of Lighthouse and the browser. Prints one
// JSON line per figure; `gym/benchmarks/phone.py` starts the server, makes the demo gym and adds up.

import { execFile } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { setTimeout as sleep } from "node:timers/promises";
import { promisify } from "node:util";
import { start, startOwn } from "../../../viewer/tests/browser.mjs";
import { line } from "./line.mjs";
import { signIn } from "./place.mjs";

const SLOWER = 4;
const LINE = { down: 9e6, up: 1.5e6, roundTrip: 60 };
const QUIET_MS = 2000;
const WINDOW_MS = 2500; // a new window first fills its own frame, which phone browsers do not have
const PATIENCE_MS = 180_000;
const UNANSWERED_MS = 20_000;
const MAX_REQUESTS = 5;
const GYM = ".walls a";
const WALL = "wall-topo[data-ready=first], wall-topo[data-ready=detail]";

const places = JSON.parse(readFileSync(process.argv[2], "utf8"));
const tell = (name, value) => process.stdout.write(`${JSON.stringify({ name, value })}\n`);
const wall = `/g/${places.gym}/w/${places.wall}`;

/** Runs before the page's scripts: records when a place existed, when it was drawn, when the last long task ended. */
function watch(selector) {
  window.there = window.seen = 0;
  window.busy = 0;
  const look = () => {
    if (!document.querySelector(selector)) return;
    changes.disconnect();
    window.there = performance.now();
    requestAnimationFrame(() => requestAnimationFrame(() => (window.seen = performance.now())));
  };
  const changes = new MutationObserver(look);
  changes.observe(document, { subtree: true, childList: true, attributes: true, attributeFilter: ["data-ready"] });
  const note = (tasks) => tasks.getEntries().forEach((task) => (window.busy = task.startTime + task.duration));
  new PerformanceObserver(note).observe({ type: "longtask", buffered: true });
}

/** Opens a page as a slow phone does. Returns milliseconds until `selector` existed, was drawn, and the page responded to taps. */
async function opened(context, path, selector) {
  const page = await context.newPage();
  await sleep(WINDOW_MS);
  const phone = await context.newCDPSession(page);
  await phone.send("Emulation.setCPUThrottlingRate", { rate: SLOWER });
  await page.addInitScript(watch, selector);
  await page.goto(places.address + path, { waitUntil: "commit" });
  await page.waitForFunction(() => window.seen, null, { timeout: PATIENCE_MS });
  // Long tasks come for a while after; quiet that lasts ends the wait.
  await page.waitForFunction((quiet) => performance.now() > Math.max(window.seen, window.busy) + quiet, QUIET_MS);
  const [there, seen, busy] = await page.evaluate(() => [window.there, window.seen, window.busy]);
  return { page, there, seen, interactive: Math.max(seen, busy) };
}

/** Wait until the service worker has what the gym's pages need, as `offline/keepGym.ts` requests it. */
async function kept(page) {
  const there = async (address) => Boolean(navigator.serviceWorker.controller && (await caches.match(address)));
  await page.waitForFunction(there, `/api/v1/gyms/${places.gym}/scans/${places.scan}/files/page/first.glb`, { timeout: PATIENCE_MS });
}

function phoneOf(browser) {
  return browser.newContext({ viewport: { width: 390, height: 844 }, isMobile: true, hasTouch: true, deviceScaleFactor: 2, locale: "en-GB" });
}

async function timed(browser) {
  let context = await phoneOf(browser);
  const first = await opened(context, wall, WALL);
  tell("wall, first visit", first.there);
  tell("wall, first visit, drawn", first.seen);
  await kept(first.page);
  await first.page.close();
  const again = await opened(context, wall, WALL);
  tell("wall, second visit", again.there);
  tell("wall, second visit, drawn", again.seen);
  await context.close();

  context = await phoneOf(browser);
  const gym = await opened(context, `/g/${places.gym}`, GYM);
  tell("gym, seen", gym.seen);
  tell("gym, interactive", gym.interactive);
  const scripts = await gym.page.evaluate(() =>
    performance.getEntriesByType("resource").filter(({ name }) => /\.js$/.test(new URL(name).pathname) && !/\/(viewer-[^/]+|sw)\.js$/.test(name)).map(({ encodedBodySize }) => encodedBodySize),
  );
  tell("JavaScript", scripts.reduce((sum, bytes) => sum + bytes, 0) / 1000);
  await context.close();
}

/** Chromium's objections to installing the app; empty if there are none. */
async function installable(context) {
  const page = await context.newPage();
  await page.goto(`${places.address}/g/${places.gym}`);
  await kept(page);
  const session = await context.newCDPSession(page);
  const manifest = await session.send("Page.getAppManifest");
  const errors = await Promise.race([session.send("Page.getInstallabilityErrors"), sleep(UNANSWERED_MS)]);
  const isManaged = await page.evaluate(async () => Boolean((await navigator.serviceWorker.ready).active));
  await page.close();
  // Chromium never answers if it is queried while it checks itself.
  if (!errors) return null;
  return [...manifest.errors.map(({ message }) => message), ...errors.installabilityErrors.map(({ errorId }) => errorId), ...(isManaged ? [] : ["no service worker"])];
}

async function lighthouse(path, port) {
  const words = [places.lighthouse, places.address + path, `--port=${port}`, "--output=json", "--quiet", "--disable-storage-reset", "--throttling-method=provided", "--only-categories=accessibility,best-practices"];
  const { stdout } = await promisify(execFile)("node", words, { maxBuffer: 1e9 });
  const { categories, audits, runtimeError } = JSON.parse(stdout);
  if (runtimeError) throw new Error(`${path}: ${runtimeError.message}`);
  const wanting = ({ auditRefs }) => auditRefs.filter(({ id, weight }) => weight > 0 && audits[id].score !== null && audits[id].score < 1).map(({ id }) => id);
  return Object.fromEntries(Object.values(categories).map((category) => [category.id, { score: Math.round(100 * category.score), wanting: wanting(category) }]));
}

const server = await line(places.port, places.target, LINE);
const browser = await start();
for (let turn = 0; turn < places.turns; turn++) await timed(browser);
await browser.close();

// Lighthouse looks at pages of the browser that somebody signed in with.
const own = await startOwn(mkdtempSync(join(tmpdir(), "walltopo-phone-")), places.debugging, { locale: "en-GB" });
let against = null;
for (let requested = 0; !against; requested++) {
  if (requested === MAX_REQUESTS) throw new Error("Chromium does not answer whether the app can be installed");
  against = await installable(own);
}
tell("against installing", against);
const page = await own.newPage();
const go = async (path) => {
  await page.goto(places.address + path);
  await page.waitForSelector("h1");
};
for (const path of places.public) tell(`visitor ${path}`, await lighthouse(path, places.debugging));
await signIn({ page, go }, places, places.climber, { own: true });
for (const path of places.own) tell(`climber ${path}`, await lighthouse(path, places.debugging));
await own.close();
server.close();
