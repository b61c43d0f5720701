// node tests/moves.mjs INDEX.html FOLDER ROUTE CLIMBER
//
// The figure of "Suggested moves" on its way up a route, frame by frame, as FOLDER/0000.png and on (PICTURES_A_S
// of them for each second of the climb). The scan has a moves.json (`walltopo moves`).

import { mkdirSync } from "node:fs";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { ask, open, ready, settle, start } from "./browser.mjs";

const PICTURES_A_S = 5;

const [index, folder, route, climber] = process.argv.slice(2);
if (!climber) {
  process.stderr.write("usage: node tests/moves.mjs INDEX.html FOLDER ROUTE child|short|adult|tall\n");
  process.exit(2);
}
mkdirSync(folder, { recursive: true });
const browser = await start();
try {
  const size = { width: 360, height: 520 };
  const { page } = await open(browser, pathToFileURL(resolve(index)).href, size);
  await ready(page, "detail");
  const length = await ask(
    page,
    (wall, [id, who]) => {
      wall.selectRoute(id, { move: true });
      const player = wall.selection.climbing.begin();
      const choose = wall.shadowRoot.querySelector(".player select");
      choose.value = who;
      choose.dispatchEvent(new Event("change"));
      player.seek(0);
      return player.length;
    },
    [Number(route), climber],
  );
  await settle(page);
  const canvas = page.locator("wall-topo").locator("canvas").first();
  for (let k = 0; k <= (length + 1) * PICTURES_A_S; k++) {
    await ask(page, (wall, time) => wall.selection.climbing.player.seek(time), k / PICTURES_A_S);
    await settle(page);
    await canvas.screenshot({ path: join(folder, `${String(k).padStart(4, "0")}.png`) });
  }
} finally {
  await browser.close();
}
