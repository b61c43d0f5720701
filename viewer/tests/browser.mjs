// Starts Chromium for the checks, and gathers what a page says and asks for.

import { chromium } from "playwright-core";

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

export function start() {
  const executablePath = process.env.WALLTOPO_CHROMIUM ?? "/usr/bin/chromium";
  return chromium.launch({ executablePath, headless: true, args: ARGUMENTS });
}

/** A page of its own with the viewer loaded; `log` fills with errors and foreign requests. */
export async function open(browser, url, options = {}) {
  const { width = 1000, height = 700, dark = false, phone = false, wait = true, scale = 1 } = options;
  const context = await browser.newContext({
    viewport: { width, height },
    colorScheme: dark ? "dark" : "light",
    hasTouch: phone,
    isMobile: phone,
    reducedMotion: "reduce",
    deviceScaleFactor: scale,
  });
  const page = await context.newPage();
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
  if (wait) await ready(page);
  return { page, log, close: () => context.close() };
}

/** Wait until the first tier (or an error) stands and a frame was drawn. */
export async function ready(page, tier = "first") {
  const states = tier === "first" ? ["first", "detail", "error"] : [tier, "error"];
  const selector = states.map((state) => `wall-topo[data-ready=${state}]`).join(",");
  await page.waitForSelector(selector, { timeout: 60_000 });
  await settle(page);
}

/** Let the camera arrive and the frame be drawn. */
export async function settle(page) {
  await page.evaluate(
    () =>
      new Promise((resolve) => {
        let left = 8;
        const step = () => (left-- > 0 ? requestAnimationFrame(step) : resolve());
        requestAnimationFrame(step);
      }),
  );
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

/** Click the canvas where a hold is drawn. */
export async function tapHold(page, id) {
  const at = await ask(
    page,
    (wall, hold) => {
      const box = wall.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const place = wall.project(hold);
      return { x: box.left + place.x, y: box.top + place.y };
    },
    id,
  );
  await page.mouse.click(at.x, at.y);
  await settle(page);
}
