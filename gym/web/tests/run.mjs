// node run.mjs PLACES.json: runs every check, prints one JSON line each, always exits 0.

import { readFileSync } from "node:fs";
import { start } from "../../../viewer/tests/browser.mjs";
import { account } from "./account.mjs";
import { climbing } from "./climbing.mjs";
import { competitions } from "./competitions.mjs";
import { forms } from "./forms.mjs";
import { hall } from "./hall.mjs";
import { insights } from "./insights.mjs";
import { progress } from "./progress.mjs";
import { publishing } from "./publishing.mjs";
import { setting } from "./setting.mjs";

const places = JSON.parse(readFileSync(process.argv[2], "utf8"));
const only = process.argv[3] ?? "";
const browser = await start();
for (const [name, check] of Object.entries({ ...forms, ...setting, ...publishing, ...progress, ...insights, ...climbing, ...competitions, ...account, ...hall })) {
  if (!name.includes(only)) continue;
  let problem = "";
  const began = Date.now();
  try {
    await check(browser, places);
  } catch (error) {
    problem = (error.stack ?? error.message).slice(0, 2000);
    let number = 0;
    for (const context of browser.contexts()) {
      for (const page of context.pages()) {
        const path = `${places.shots}/failed-${number++}.png`;
        await page.screenshot({ path, timeout: 20_000 }).catch(() => undefined);
      }
      await context.close();
    }
  }
  process.stdout.write(`${JSON.stringify({ name, problem, seconds: (Date.now() - began) / 1000 })}\n`);
}
await browser.close();
