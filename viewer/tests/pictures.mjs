// node tests/pictures.mjs INDEX.html OUT.jpg [whole|route|phone] [route id]
//
// Pictures of a finished scan's page for the README, as JPEG below 200 kB.
//   whole: 1280 x 720, the wall as it opens;  route: the same, one route lit and framed;
//   phone: 390 x 844 at two pixels a point, the route lit (without an id: as it opens).
// The heading is the scan folder's name.

import { statSync } from "node:fs";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { ask, open, ready, settle, start } from "./browser.mjs";

const MOST_BYTES = 200_000;
const [source, out, kind = "whole", id] = process.argv.slice(2);
if (!source || !out || !["whole", "route", "phone"].includes(kind)) {
  process.stderr.write("usage: node tests/pictures.mjs INDEX.html OUT.jpg [whole|route|phone] [route id]\n");
  process.exit(2);
}
const size =
  kind === "phone" ? { width: 390, height: 844, phone: true, scale: 2 } : { width: 1280, height: 720 };
const browser = await start();
try {
  const { page } = await open(browser, pathToFileURL(resolve(source)).href, size);
  await ready(page, "detail");
  if (kind !== "whole" && id !== undefined) {
    await ask(page, (wall, route) => wall.selectRoute(route, { move: true }), Number(id));
    await page.waitForTimeout(600); // the fade
    await settle(page);
  }
  for (let quality = 88; quality >= 40; quality -= 8) {
    await page.screenshot({ path: out, type: "jpeg", quality });
    if (statSync(out).size < MOST_BYTES) break;
  }
  process.stdout.write(`${out}: ${Math.round(statSync(out).size / 1000)} kB\n`);
} finally {
  await browser.close();
}
