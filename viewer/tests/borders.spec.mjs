// The smooth borders of holds, as they are drawn.

import assert from "node:assert/strict";
import { ask, open, ready, settle } from "./browser.mjs";
import { test } from "./fixtures.mjs";

test("the drawn border is smooth on the wall too", async ({ browser, places: { disk, shots } }) => {
  const { page, close } = await open(browser, disk, { scale: 2 });
  await ready(page, "detail");
  await ask(page, (wall) => {
    wall.selectRoute(1);
    const [x, y, z] = wall.holds.find(({ id }) => id === 1).position;
    void wall.stage.rig.controls.setLookAt(x, y - 1.6, z, x, y, z, false);
    wall.stage.redraw();
  });
  await settle(page);
  await page.screenshot({ path: `${shots}/border.png` });
  // The hold of the made scan is a circle around its place: where its colour ends along rays from there.
  const radii = await ask(page, async (wall) => {
    const picture = await createImageBitmap(await wall.screenshot());
    const canvas = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
    const pen = canvas.getContext("2d");
    pen.drawImage(picture, 0, 0);
    const dense = picture.width / wall.shadowRoot.querySelector("canvas").clientWidth;
    const at = wall.project(1);
    const white = (x, y) => Math.min(...pen.getImageData(Math.round(x * dense), Math.round(y * dense), 1, 1).data.slice(0, 3)) > 225;
    return [...Array(180).keys()].map((k) => {
      const turn = (k / 180) * 2 * Math.PI;
      for (let r = 20; r < 500; r += 0.25) {
        if (white(at.x + r * Math.cos(turn), at.y + r * Math.sin(turn))) return r;
      }
      return NaN;
    });
  });
  assert.ok(radii.every(Number.isFinite), "the outline is not closed");
  const jumps = radii.map((r, k) => Math.abs(r - (radii[(k + 179) % 180] + radii[(k + 1) % 180]) / 2));
  const mean = radii.reduce((sum, r) => sum + r, 0) / 180;
  const rough = jumps.reduce((sum, value) => sum + value, 0) / 180 / mean;
  assert.ok(rough < 0.006, `the outline is rough: ${rough} of its radius of ${mean} px`);
  await close();
});
