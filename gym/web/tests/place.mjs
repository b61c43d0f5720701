// A browser on the platform: signs in, waits for conditions, and collects errors.

import assert from "node:assert/strict";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { isDeepStrictEqual } from "node:util";

const require = createRequire(new URL("../../../viewer/package.json", import.meta.url));
const AXE = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const PATIENCE_MS = 90_000;

let seen = [];

/** Begin a new list of all that the browsers of `visit` report, for a test that fails. */
export const watchErrors = () => (seen = []);

/** Messages of the console that belong to a test: without reception, and by the status of an answer. */
export const OFFLINE = /net::ERR_|Failed to fetch|NetworkError|status of 50\d/;
export const answered = (status) => new RegExp(`status of ${status}`);

/** Wait for a condition that node checks: Playwright's `waitForFunction` takes a promise of the page for true. */
export async function until(is, what = String(is)) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; await new Promise((resolve) => setTimeout(resolve, 200))) {
    if (await is()) return;
  }
  throw new Error(`not so after ${PATIENCE_MS / 1000} s: ${what}`);
}

/** Wait until what a function reads equals what is wanted; fail with the difference. */
export async function becomes(read, wanted) {
  let last;
  const is = async () => isDeepStrictEqual((last = await read()), wanted);
  await until(is).catch(() => assert.deepEqual(last, wanted));
}

/** Wait until so many elements are there. */
export const counted = (locator, number) => becomes(() => locator.count(), number);

/** Wait until the service worker has a copy of a path, whose text a pattern matches. */
export const stored = (page, path, text = /(?:)/) =>
  until(() => page.evaluate(async ([wanted, pattern]) => {
    const copy = await caches.match(wanted);
    return copy !== undefined && new RegExp(pattern).test(await copy.text());
  }, [path, text.source]), `${path} is stored`);

/**
 * A browser of one person; `log` collects errors and requests to other hosts. A test names those that it causes by
 * `expected`, before or after they come: a late one then fails nothing, and another one is still seen.
 */
export async function visit(browser, places, { phone = true, dark = false, locale = "en-GB", worker = true, ...look } = {}) {
  const viewport = phone ? { width: 390, height: 844 } : { width: 1280, height: 800 };
  const context = await browser.newContext({
    viewport, isMobile: phone, hasTouch: phone, locale, colorScheme: dark ? "dark" : "light", reducedMotion: "reduce",
    serviceWorkers: worker ? "allow" : "block", ...look,
  });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  const log = [];
  const patterns = [];
  const expected = (...more) => patterns.push(...more);
  const report = (line) => (log.push(line), seen.push(`${page.url()}: ${line}`));
  page.on("pageerror", (error) => report(error.message));
  page.on("console", (message) => message.type() === "error" && report(message.text()));
  page.on("request", (request) => {
    const { protocol, origin } = new URL(request.url());
    if (!["blob:", "data:"].includes(protocol) && origin !== places.address) report(`request to ${request.url()}`);
  });
  const go = async (path) => {
    await page.goto(places.address + path);
    await page.waitForSelector("h1");
  };
  const shot = (name) => page.screenshot({ path: join(places.shots, `${name}-${phone ? "phone" : "laptop"}.png`) });
  const close = async () => {
    await context.close();
    assert.deepEqual(log.filter((line) => !patterns.some((pattern) => pattern.test(line))), []);
  };
  return { page, context, go, shot, expected, close };
}

/** Sign in, by the form only where no earlier browser of this person left a session: more than ten sign-ins of one
    person in a quarter of an hour are refused. `own` asks for a session of this browser alone. */
export async function signIn({ page, go }, places, email, { own = false } = {}) {
  const kept = join(dirname(places.log), `session-${email}.json`);
  const context = page.context();
  if (!own && existsSync(kept)) {
    await context.addCookies(JSON.parse(readFileSync(kept, "utf8")));
    if ((await context.request.get(`${places.address}/api/v1/me`)).ok()) {
      await go("/sign-in");
      await page.evaluate(() => localStorage.setItem("walltopo-signed-in", "yes")); // else the app asks for nobody
      await go("/");
      // The start page may lead on to the gym seen last.
      return await page.getByRole("heading", { name: /^(My gyms|Find a route)$/ }).first().waitFor();
    }
    await context.clearCookies();
  }
  await go("/sign-in");
  await page.evaluate(() => localStorage.removeItem("walltopo-before-sign-in")); // it would lead to another page
  await page.getByLabel("Email").fill(email);
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Sign in", exact: true }).click();
  await page.getByRole("heading", { name: "My gyms" }).waitFor();
  if (!own) writeFileSync(kept, JSON.stringify(await context.cookies()));
}

/** Wait until the wall's first tier is drawn. */
export async function wallDrawn(page) {
  await page.waitForSelector("wall-topo[data-ready=first], wall-topo[data-ready=detail]", { timeout: PATIENCE_MS });
}

/** Name all routes of a review by keyboard and grade the first one; returns how many there are. */
export async function nameRoutes(page) {
  const names = page.locator("[data-field=name]");
  const rows = await names.count();
  await names.first().focus();
  for (let row = 1; row <= rows; row++) {
    await page.keyboard.type(`Moon ${row}`);
    await page.keyboard.press("Enter");
  }
  await page.locator("[data-field=grade]").first().focus();
  await page.keyboard.type("6A");
  await page.keyboard.press("Enter");
  return rows;
}

/** The secret of the last mailed link: without SMTP the operator's console shows mails. */
export async function mailed(places, path) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; ) {
    // A secret without anything after it may be half written.
    const links = [...readFileSync(places.log, "utf8").matchAll(new RegExp(`${path}#(\\S+)\\s`, "g"))];
    if (links.length) return links.at(-1)[1];
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`no mail with a link to ${path}`);
}

/** By how many pixels a page is wider than its window; a phone's browser counts what stands over into `innerWidth`. */
export async function tooWide(page) {
  return (await page.evaluate(() => document.documentElement.scrollWidth)) - page.viewportSize().width;
}

/** The serious axe findings of a page, as lines; `rules`: those that axe leaves out by itself. */
export async function grave(page, rules = []) {
  await page.evaluate(AXE);
  const options = { iframes: false, rules: Object.fromEntries(rules.map((rule) => [rule, { enabled: true }])) };
  const found = await page.evaluate((how) => window.axe.run(document, how), options);
  assert.ok(found.passes.length > 8, "axe saw nothing");
  return found.violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, nodes }) => `${id}: ${nodes[0].html.slice(0, 160)}`);
}
