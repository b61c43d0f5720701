// node run.mjs PLACES.json [WORD]: runs every check (with WORD in its name), prints one JSON line
// each, always exits 0.

import { readFileSync } from "node:fs";
import { borders } from "./borders.mjs";
import { start } from "./browser.mjs";
import { checks } from "./checks.mjs";
import { editing } from "./editing.mjs";
import { foreign } from "./foreign.mjs";
import { frames } from "./frames.mjs";
import { hands } from "./hands.mjs";
import { page } from "./page.mjs";
import { resets } from "./reset.mjs";
import { tasks } from "./tasks.mjs";

const places = JSON.parse(readFileSync(process.argv[2], "utf8"));
const only = process.argv[3];
const browser = await start();
for (const [name, check] of Object.entries({ ...checks, ...hands, ...frames, ...editing, ...foreign, ...page, ...borders, ...tasks, ...resets })) {
  if (only && !name.includes(only)) continue;
  let problem = "";
  const began = Date.now();
  try {
    await check(browser, places);
  } catch (error) {
    problem = error.message.slice(0, 2000) || "failed";
    // What a failed check leaves open would slow down the ones after it.
    for (const context of browser.contexts()) await context.close();
  }
  process.stdout.write(`${JSON.stringify({ name, problem, seconds: (Date.now() - began) / 1000 })}\n`);
}
await browser.close();
