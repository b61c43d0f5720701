// node alone.mjs URL ...: opens pages that were exported on their own, waits for the finer tier,
// taps the first hold, and prints one JSON line each: what was wrong, and what was asked for.

import { ask, open, ready, settle, start, tapHold } from "./browser.mjs";

const browser = await start();
for (const url of process.argv.slice(2)) {
  const asked = [];
  let problem = "";
  try {
    const prepare = (page) => page.on("request", (request) => asked.push(request.url().slice(0, 200)));
    const { page, log, close } = await open(browser, url, { prepare });
    await ready(page, "detail");
    if ((await page.getAttribute("wall-topo", "data-ready")) !== "detail") problem = "no finer tier";
    const hold = await ask(page, (wall) => wall.holds[0].id);
    await tapHold(page, hold);
    await settle(page);
    if ((await ask(page, (wall) => wall.selectedHold)) !== hold) problem ||= "the tap chose another hold";
    if (log.errors.length || log.foreign.length) problem ||= JSON.stringify(log);
    await close();
  } catch (error) {
    problem = error.message;
  }
  process.stdout.write(`${JSON.stringify({ url, problem, asked })}\n`);
}
await browser.close();
