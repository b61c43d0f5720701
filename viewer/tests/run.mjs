// node run.mjs PLACES.json: runs every check, prints one JSON line each, always exits 0.

import { readFileSync } from "node:fs";
import { start } from "./browser.mjs";
import { checks } from "./checks.mjs";

const places = JSON.parse(readFileSync(process.argv[2], "utf8"));
const only = process.argv[3];
const browser = await start();
for (const [name, check] of Object.entries(checks)) {
  if (only && !name.includes(only)) continue;
  let problem = "";
  try {
    await check(browser, places);
  } catch (error) {
    problem = error.message.slice(0, 2000);
  }
  process.stdout.write(`${JSON.stringify({ name, problem })}\n`);
}
await browser.close();
