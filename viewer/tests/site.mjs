// node tests/site.mjs ADDRESS PAGE...: axe over pages of the built documentation, in light and dark, on a laptop
// and a phone. Prints one JSON line a page and look, with what is wrong and which other hosts were asked.

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { start } from "./browser.mjs";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"];
const LOOKS = [
  { colorScheme: "light", viewport: { width: 1280, height: 800 } },
  { colorScheme: "dark", viewport: { width: 390, height: 844 } },
];

const [address, ...pages] = process.argv.slice(2);
const browser = await start();
for (const name of pages) {
  for (const look of LOOKS) {
    const context = await browser.newContext(look);
    const page = await context.newPage();
    const foreign = [];
    page.on("request", (request) => {
      const { protocol, origin } = new URL(request.url());
      if (protocol.startsWith("http") && origin !== new URL(address).origin) foreign.push(request.url());
    });
    await page.goto(new URL(name, address).href, { waitUntil: "load" });
    await page.evaluate(AXE);
    const { violations, passes } = await page.evaluate((runOnly) => window.axe.run(document, { runOnly }), RULES);
    const wrong = violations.map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.html).slice(0, 3).join(" ")}`);
    process.stdout.write(`${JSON.stringify({ name, look: look.colorScheme, passed: passes.length, wrong, foreign })}\n`);
    await context.close();
  }
}
await browser.close();
