// A browser on the platform: signs in, waits for conditions, and gathers what must not be there.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(new URL("../../../viewer/package.json", import.meta.url));
const AXE = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const PATIENCE_MS = 90_000;

/** A browser of somebody's own; `log` fills with errors and with what other hosts were asked for. */
export async function visit(browser, places, { phone = true, dark = false, locale = "en-GB" } = {}) {
  const viewport = phone ? { width: 390, height: 844 } : { width: 1280, height: 800 };
  const context = await browser.newContext({
    viewport, isMobile: phone, hasTouch: phone, locale, colorScheme: dark ? "dark" : "light", reducedMotion: "reduce",
  });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  const log = [];
  page.on("pageerror", (error) => log.push(error.message));
  page.on("console", (message) => message.type() === "error" && log.push(message.text()));
  page.on("request", (request) => {
    const { protocol, origin } = new URL(request.url());
    if (!["blob:", "data:"].includes(protocol) && origin !== places.address) log.push(`asked for ${request.url()}`);
  });
  const go = async (path) => {
    await page.goto(places.address + path);
    await page.waitForSelector("h1");
  };
  const shot = (name) => page.screenshot({ path: join(places.shots, `${name}-${phone ? "phone" : "laptop"}.png`) });
  const close = async () => {
    await context.close();
    assert.deepEqual(log, []);
  };
  return { page, context, go, shot, log, close };
}

export async function signIn({ page, go }, places, email) {
  await go("/sign-in");
  await page.getByLabel("E-mail").fill(email);
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Sign in", exact: true }).click();
  await page.getByRole("heading", { name: "My gyms" }).waitFor();
}

/** Until the wall's first tier is drawn. */
export async function wallDrawn(page) {
  await page.waitForSelector("wall-topo[data-ready=first], wall-topo[data-ready=detail]", { timeout: PATIENCE_MS });
}

/** The secret of the last link that was mailed: the operator's console shows mails that nobody sends. */
export async function mailed(places, path) {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; ) {
    const links = [...readFileSync(places.log, "utf8").matchAll(new RegExp(`${path}#(\\S+)`, "g"))];
    if (links.length) return links.at(-1)[1];
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  throw new Error(`no mail with a link to ${path}`);
}

/** By how many pixels a page is wider than its window; a phone's browser counts what stands over into `innerWidth`. */
export async function tooWide(page) {
  return (await page.evaluate(() => document.documentElement.scrollWidth)) - page.viewportSize().width;
}

/** What axe finds grave on a page, as lines. */
export async function grave(page) {
  await page.evaluate(AXE);
  const found = await page.evaluate(() => window.axe.run(document, { iframes: false }));
  assert.ok(found.passes.length > 8, "axe saw nothing");
  return found.violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .map(({ id, nodes }) => `${id}: ${nodes[0].html.slice(0, 160)}`);
}
