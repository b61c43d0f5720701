// node tests/picking.mjs INDEX.html [COUNT]: how long picking takes, on this machine.
//
// Finds COUNT (4,000) points spread evenly over the picture as it opens that show the wall, then
// casts a ray through each and prints, in milliseconds, the mean per pick and that of the slowest
// 100 in a row. One pick is what a tap costs before anything is drawn.

import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { ask, open, start } from "./browser.mjs";

const [source, count = "4000"] = process.argv.slice(2);
if (!source) {
  process.stderr.write("usage: node tests/picking.mjs INDEX.html [COUNT]\n");
  process.exit(2);
}
const browser = await start();
try {
  const { page } = await open(browser, pathToFileURL(resolve(source)).href, { width: 1280, height: 720 });
  const result = await ask(
    page,
    (wall, total) => {
      const { clientWidth, clientHeight } = wall.shadowRoot.querySelector("canvas");
      // An additive recurrence covers the picture evenly without a pattern.
      const places = [];
      for (let k = 0; places.length < total && k < 100 * total; k++) {
        const x = ((0.5 + k * 0.7548776662) % 1) * clientWidth;
        const y = ((0.5 + k * 0.569840291) % 1) * clientHeight;
        if (wall.pickAt(x, y) !== null) places.push([x, y]);
      }
      const spent = [];
      for (let k = 0; k + 100 <= places.length; k += 100) {
        const began = performance.now();
        for (const [x, y] of places.slice(k, k + 100)) wall.pickAt(x, y);
        spent.push((performance.now() - began) / 100);
      }
      const mean = spent.reduce((sum, value) => sum + value, 0) / spent.length;
      return { picks: 100 * spent.length, mean_ms: mean, slowest_100_ms: Math.max(...spent) };
    },
    Number(count),
  );
  const round = (value) => Math.round(value * 1000) / 1000;
  result.mean_ms = round(result.mean_ms);
  result.slowest_100_ms = round(result.slowest_100_ms);
  process.stdout.write(`${JSON.stringify(result)}\n`);
} finally {
  await browser.close();
}
