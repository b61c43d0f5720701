// node tests/pictures.mjs INDEX.html OUT.jpg [whole|route|phone|phone-route] [route id]
// node tests/pictures.mjs ADDRESS OUT.jpg edit HOLD
// node tests/pictures.mjs --readme GYM SPRAYWALL [FOLDER]
//
// Pictures of a finished scan's page for the README, as JPEG below 200 kB.
//   whole: 1280 x 720, the wall as it opens;  route: the same, one route lit and framed;
//   edit: the same of a page in edit mode (the address that `walltopo view --edit` shows), with a hold
//   chosen and its photos open;
//   embed: 900 x 760, the page that has the wall within it;
//   phone: 390 x 844 at two pixels a point, as it opens;  phone-route: the route lit.
// Without an id the route with the most holds is lit. The heading is the scan folder's name.
// --readme takes all of the README's pictures of two scan folders into FOLDER (docs/pictures).
// --setter takes those of the setter's page of one scan folder into FOLDER (docs/pictures/setter); they are
// smaller, and one of them shows examples/embed.html (a wall within a page).

import { copyFileSync, rmSync, statSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { ask, open, ready, settle, start } from "./browser.mjs";

const MAX_BYTES = 200_000;
const KINDS = ["whole", "route", "edit", "embed", "phone", "phone-route"];
const README = [
  ["gym", "whole", "viewer-gym-a.jpg"],
  ["gym", "route", "viewer-gym-a-route.jpg"],
  ["gym", "phone", "viewer-gym-a-phone.jpg"],
  ["gym", "phone-route", "viewer-gym-a-phone-route.jpg"],
  ["spraywall", "whole", "viewer-spraywall.jpg"],
];

const SETTER = [
  ["whole", "wall.jpg"],
  ["phone-route", "phone.jpg"],
  ["embed", "web.jpg"],
];
const SETTER_BYTES = 80_000;
const ROOT = resolve(import.meta.dirname, "../..");

/** The size of the window for a kind of picture. */
function sizeOf(kind) {
  if (kind.startsWith("phone")) return { width: 390, height: 844, phone: true, scale: 2 };
  return kind === "embed" ? { width: 900, height: 760 } : { width: 1280, height: 720 };
}

/** One picture; says what it wrote. */
async function take(browser, source, out, kind, id, most = MAX_BYTES) {
  const size = sizeOf(kind);
  const url = kind === "edit" ? source : pathToFileURL(resolve(source)).href;
  const { page, close } = await open(browser, url, size);
  await ready(page, "detail");
  if (kind.endsWith("route")) {
    await ask(
      page,
      (wall, wished) => {
        const most = (a, b) => b.holds.length - a.holds.length || a.id - b.id;
        wall.selectRoute(wished ?? wall.routes.sort(most)[0].id, { move: true });
      },
      id === undefined ? null : Number(id),
    );
  }
  if (kind === "edit") {
    await page.waitForFunction(() => document.querySelector("wall-topo").parts.editor?.session.busy === false);
    await ask(page, (wall, hold) => wall.selectHold(hold), Number(id));
    const photos = page.locator("wall-topo").locator(".photos");
    await photos.locator("summary").click();
    await photos.locator("img").first().waitFor();
  }
  await settle(page);
  const isQuiet = () => {
    const { shadowRoot } = document.querySelector("wall-topo");
    const fades = shadowRoot.getAnimations().some(({ playState }) => playState === "running");
    return !fades && !shadowRoot.querySelector(".toast.on");
  };
  await page.waitForFunction(isQuiet);
  for (let quality = 88; quality >= 40; quality -= 8) {
    await page.screenshot({ path: out, type: "jpeg", quality });
    if (statSync(out).size < most) break;
  }
  process.stdout.write(`${out}: ${Math.round(statSync(out).size / 1000)} kB\n`);
  await close();
}

/** The setter's pictures: the page with a wall in it lies beside the scan's own page meanwhile. */
async function takeSetters(browser, scan, folder) {
  for (const [kind, name] of SETTER) {
    const embed = kind === "embed" ? join(scan, "embed.html") : "";
    if (embed) copyFileSync(join(ROOT, "examples/embed.html"), embed);
    await take(browser, embed || join(scan, "index.html"), join(folder, name), kind, undefined, SETTER_BYTES);
    if (embed) rmSync(embed);
  }
}

const [first, second, third, fourth] = process.argv.slice(2);
const setter = first === "--setter";
const all = first === "--readme";
if (!first || !second || (all ? !third : !setter && !KINDS.includes(third ?? "whole"))) {
  process.stderr.write(
    `usage: node tests/pictures.mjs INDEX.html OUT.jpg [${KINDS.join("|")}] [route id]\n` +
      "       node tests/pictures.mjs --readme GYM SPRAYWALL [FOLDER]\n" +
      "       node tests/pictures.mjs --setter SCAN [FOLDER]\n",
  );
  process.exit(2);
}
const browser = await start();
try {
  if (setter) {
    await takeSetters(browser, second, third ?? join(ROOT, "docs/pictures/setter"));
  } else if (all) {
    const scans = { gym: second, spraywall: third };
    const folder = fourth ?? join(ROOT, "docs/pictures");
    for (const [scan, kind, name] of README) {
      await take(browser, join(scans[scan], "index.html"), join(folder, name), kind);
    }
  } else {
    await take(browser, first, second, third ?? "whole", fourth);
  }
} finally {
  await browser.close();
}
