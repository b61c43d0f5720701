// Starts Chromium for the checks, and gathers what a page says and asks for.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { chromium } from "playwright-core"; // not the test runner: the platform has a runner of its own

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

// For one action on a loaded machine: a screenshot of a large canvas alone can take half a minute there.
export const PATIENCE_MS = 180_000;

const ARGUMENTS = [
  "--no-sandbox",
  "--disable-gpu",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--ignore-gpu-blocklist",
];

const executablePath = process.env.WALLTOPO_CHROMIUM ?? "/usr/bin/chromium";

export const LAUNCH = { executablePath, headless: true, args: ARGUMENTS };

export function start() {
  return chromium.launch(LAUNCH);
}

/** A browser whose profile is the folder; what else speaks to Chromium finds it at the port. */
export function startOwn(folder, port, options = {}) {
  const args = [...ARGUMENTS, `--remote-debugging-port=${port}`];
  return chromium.launchPersistentContext(folder, { executablePath, headless: true, args, ...options });
}

/**
 * Ways to break every page that is opened, for proving that the checks notice. Each runs in the
 * page before its scripts.
 */
const SABOTAGE = {
  load: () => {
    window.fetch = () => Promise.reject(new Error("sabotage"));
    Object.defineProperty(window, "wallTopoTiers", { get: () => ({}), set() {} });
  },
  draw: () => {
    for (const name of ["drawElements", "drawArrays"]) WebGL2RenderingContext.prototype[name] = () => {};
  },
  tap: () => {
    const deaf = (event) => event.stopImmediatePropagation();
    for (const type of ["pointerdown", "mousedown", "wheel"]) window.addEventListener(type, deaf, true);
  },
  write: () => {
    const send = WebGL2RenderingContext.prototype.texSubImage2D;
    WebGL2RenderingContext.prototype.texSubImage2D = function (...rest) {
      // Pictures come in larger pieces.
      if (!rest.some((value) => value?.byteLength <= 2 ** 16)) send.apply(this, rest);
    };
  },
};

/**
 * A page of its own with the viewer loaded; `log` fills with errors and foreign requests. Throws
 * where the page ends up with an error although none is expected (`fails`), so that no check can
 * pass on a page that does not work. `before` runs in the page before its own scripts.
 */
export async function open(browser, url, options = {}) {
  const { width = 1000, height = 700, dark = false, phone = false, wait = true, scale = 1 } = options;
  const { fails = false, motion = false, before, prepare, locale = "en-GB", ...look } = options;
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: dark ? "dark" : "light",
    locale,
    hasTouch: phone,
    isMobile: phone,
    reducedMotion: motion ? "no-preference" : "reduce",
    deviceScaleFactor: scale,
    ...look,
  });
  context.setDefaultTimeout(PATIENCE_MS);
  const page = await context.newPage();
  const sabotage = SABOTAGE[process.env.WALLTOPO_SABOTAGE];
  if (sabotage) await page.addInitScript(sabotage);
  if (before) await page.addInitScript(before);
  if (prepare) await prepare(page);
  const log = { errors: [], foreign: [] };
  const own = new URL(url);
  page.on("pageerror", (error) => log.errors.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error") log.errors.push(message.text());
  });
  page.on("request", (request) => {
    const asked = new URL(request.url());
    const local = ["blob:", "data:"].includes(asked.protocol);
    if (!local && (asked.protocol !== own.protocol || asked.host !== own.host)) {
      log.foreign.push(request.url());
    }
  });
  await page.goto(url);
  if (wait) {
    await ready(page);
    const failed = (await page.getAttribute("wall-topo", "data-ready")) === "error";
    if (failed !== fails) {
      await context.close();
      throw new Error(failed ? "the page shows an error" : "the page shows no error");
    }
  }
  return { page, log, close: () => context.close() };
}

/** Wait until the first tier (or an error) stands and a frame was drawn. */
export async function ready(page, tier = "first") {
  const states = tier === "first" ? ["first", "detail", "error"] : [tier, "error"];
  const selector = states.map((state) => `wall-topo[data-ready=${state}]`).join(",");
  await page.waitForSelector(selector, { timeout: PATIENCE_MS });
  const idle = () => {
    const { stage } = document.querySelector("wall-topo");
    return !stage?.shaping && (!stage?.picking || stage.picking.trees.length > 0);
  };
  await page.waitForFunction(idle, null, { timeout: PATIENCE_MS });
  await settle(page);
}

/** Wait until the camera rests, no fade runs and everything is drawn: the viewer requests no further frame. */
export async function settle(page) {
  // A change that the page has just made requests its frame within one turn.
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve))));
  const rests = () => (document.querySelector("wall-topo").stage?.request ?? 0) === 0;
  await page.waitForFunction(rests, null, { timeout: PATIENCE_MS, polling: 50 });
}

/** A finger's way over the screen: a list for each finger, all of one length. */
export async function fingers(page, ...ways) {
  const client = await page.context().newCDPSession(page);
  const send = (type, touchPoints) => client.send("Input.dispatchTouchEvent", { type, touchPoints });
  const at = (step, count = ways.length) => ways.slice(0, count).map((way, id) => ({ ...way[step], id }));
  for (let count = 1; count <= ways.length; count++) await send("touchStart", at(0, count));
  for (let step = 1; step < ways[0].length; step++) {
    await send("touchMove", at(step));
    await settle(page);
  }
  await send("touchEnd", []);
  await client.detach();
}

/** Run a function in the page with the element as its first argument. */
export function ask(page, action, argument) {
  return page.evaluate(
    ([source, value]) => {
      const element = document.querySelector("wall-topo");
      return new Function(`return (${source})`)()(element, value);
    },
    [action.toString(), argument],
  );
}

/** Where a hold is drawn, in CSS pixels of the page. */
export function placeOf(page, id) {
  return ask(
    page,
    (wall, hold) => {
      const box = wall.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const place = wall.project(hold);
      return { x: box.left + place.x, y: box.top + place.y };
    },
    id,
  );
}

/** Click the canvas where a hold is drawn. */
export async function tapHold(page, id) {
  const at = await placeOf(page, id);
  await page.mouse.click(at.x, at.y);
  await settle(page);
}

/** Mean colour per cell of a coarse grid over the drawn picture, 0..255. */
export function cells(page, columns = 24, rows = 16) {
  return ask(
    page,
    async (wall, [w, h]) => {
      const picture = await createImageBitmap(await wall.screenshot());
      const canvas = Object.assign(document.createElement("canvas"), { width: w, height: h });
      const pen = canvas.getContext("2d");
      pen.imageSmoothingQuality = "high";
      pen.drawImage(picture, 0, 0, w, h);
      return [...pen.getImageData(0, 0, w, h).data];
    },
    [columns, rows],
  );
}

/** How many different colours `cells` saw: a blank picture has one. */
export const spread = (values) => {
  const colours = new Set();
  for (let k = 0; k < values.length; k += 4) colours.add(values.slice(k, k + 3).map((v) => v >> 5).join());
  return colours.size;
};

/** What is chosen. */
export const state = (page) => ask(page, (wall) => ({ route: wall.selectedRoute, hold: wall.selectedHold }));

/** Text of an element inside the viewer. */
export const text = (page, selector) =>
  ask(page, (wall, query) => wall.shadowRoot.querySelector(query)?.textContent ?? null, selector);

/** Holds that are not inside the part of the canvas that is seen. */
export const outside = (page) =>
  ask(page, (wall) => {
    const { clientWidth, clientHeight } = wall.shadowRoot.querySelector("canvas");
    const off = ({ x, y, ahead }) => !ahead || x < 0 || y < 0 || x > clientWidth || y > clientHeight;
    return wall.holds.filter((hold) => off(wall.project(hold.id))).map((hold) => hold.id);
  });

/** No errors, and nothing asked of another host. */
export function fine(log) {
  assert.deepEqual(log.foreign, [], "the page asked another host");
  assert.deepEqual(log.errors, [], "the page reported errors");
}

/** Of each hold: its route, and how far from grey it is drawn, 0 to 255. */
export async function colourfulness(page) {
  const rows = await ask(page, async (wall) => {
    const picture = await createImageBitmap(await wall.screenshot());
    const canvas = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
    const pen = canvas.getContext("2d");
    pen.drawImage(picture, 0, 0);
    const dense = picture.width / wall.shadowRoot.querySelector("canvas").clientWidth;
    return wall.holds.map(({ id, route }) => {
      const { x, y } = wall.project(id);
      const rgb = [...pen.getImageData(x * dense, y * dense, 1, 1).data].slice(0, 3);
      return [id, { route, value: Math.max(...rgb) - Math.min(...rgb) }];
    });
  });
  return new Map(rows);
}

/** What axe finds grave on a page, as lines; `rules`: those that it leaves out by itself. */
export async function graveFindings(page, rules = []) {
  await page.evaluate(AXE);
  const options = { iframes: false, rules: Object.fromEntries(rules.map((rule) => [rule, { enabled: true }])) };
  const found = await page.evaluate((how) => axe.run(document, how), options);
  assert.ok(found.passes.length > 10, "axe saw nothing");
  const grave = found.violations.filter(({ impact }) => ["serious", "critical"].includes(impact));
  return grave.map(({ id, nodes }) => `${id}: ${nodes.map((n) => n.target).join(" ")}`);
}
