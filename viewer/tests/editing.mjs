// What must hold of the editor.

import assert from "node:assert/strict";
import { ask, open, settle, tapHold } from "./browser.mjs";
import { fine } from "./checks.mjs";

/** Corrections by hand. */
export const editing = {
  async "edits are made, undone and saved beside the scan"(browser, { edit, shots }) {
    const { page, log, close } = await open(browser, edit, { width: 1200, height: 800 });
    const wall = page.locator("wall-topo");
    const route = (id) => ask(page, (el, hold) => el.holds.find((h) => h.id === hold)?.route, id);
    await wall.getByRole("button", { name: "Check 1" }).click();
    assert.equal(await ask(page, (el) => el.selectedHold), 2, "the hold that the scan was not sure of");
    await wall.getByRole("button", { name: "It is right" }).click();
    assert.equal(await wall.getByRole("button", { name: "Check" }).count(), 0);
    await ask(page, (el) => el.home());
    await settle(page);
    await tapHold(page, 5);
    const before = await route(5);
    await wall.getByLabel("Route", { exact: true }).selectOption("1");
    assert.equal(await route(5), 1);
    await wall.getByRole("button", { name: "Undo" }).click();
    assert.equal(await route(5), before);
    await wall.getByLabel("Colour", { exact: true }).selectOption("green");
    await wall.getByLabel("Type", { exact: true }).selectOption("crimp");
    await page.screenshot({ path: `${shots}/edit.png` });
    await wall.getByRole("button", { name: "Mark holds" }).click();
    await tapHold(page, 2);
    await tapHold(page, 6);
    await wall.getByRole("button", { name: "Make a route of 2" }).click();
    assert.equal(await route(2), 5);
    assert.equal(await route(6), 5);
    await wall.locator('[data-route="3"]').click();
    await wall.getByLabel("Name").fill("<b>Heron</b>");
    await page.keyboard.press("Tab");
    await wall.getByLabel("Merge with").selectOption("4");
    assert.equal(await ask(page, (el) => el.routes.length), 4);
    await tapHold(page, 9);
    await wall.getByRole("button", { name: "Not a hold" }).click();
    assert.equal(await ask(page, (el) => el.holds.length), 11);
    await tapHold(page, 7);
    await wall.getByRole("button", { name: "Paint" }).click();
    const at = await ask(page, (el) => {
      const box = el.shadowRoot.querySelector("canvas").getBoundingClientRect();
      const place = el.project([el.holds.find((h) => h.id === 7).position[0], 0, 1.25]);
      return { x: box.left + place.x, y: box.top + place.y };
    });
    await page.mouse.move(at.x, at.y);
    await page.mouse.down();
    await page.mouse.move(at.x + 4, at.y);
    await page.mouse.up();
    await settle(page);
    const ball = () => ask(page, (el) => el.stage.strokes.children.at(-1)?.material.color.getHexString());
    assert.equal(await ball(), "28963c", "the ball has the hold's colour");
    await wall.getByRole("button", { name: "Erase" }).click();
    await page.mouse.click(at.x, at.y + 5);
    assert.equal(await ball(), "ffffff");
    await page.mouse.click(at.x, at.y + 9);
    const balls = () => ask(page, (el) => el.stage.strokes.children.length);
    const count = await balls();
    await wall.getByRole("button", { name: "Undo" }).click();
    assert.equal(await balls(), count - 1, "undo takes the stroke away");
    await settle(page);
    await wall.getByRole("button", { name: "Save", exact: true }).click();
    await page.waitForFunction(() =>
      document.querySelector("wall-topo").shadowRoot.querySelector(".toast").textContent.includes("Saved"),
    );
    fine(log);
    await close();
  },

  async "of two tabs, the second to save is told"(browser, { edit }) {
    const tabs = [await open(browser, edit), await open(browser, edit)];
    for (const [k, { page }] of tabs.entries()) {
      const wall = page.locator("wall-topo");
      await tapHold(page, 12);
      await wall.getByLabel("Type", { exact: true }).selectOption(["sloper", "pinch"][k]);
      await wall.getByRole("button", { name: "Save", exact: true }).click();
      const said = ["Saved", "Not saved: other edits were saved"][k];
      await page.waitForFunction(
        (words) => document.querySelector("wall-topo").shadowRoot.querySelector(".toast").textContent.includes(words),
        said,
      );
    }
    const again = await open(browser, edit);
    const type = (page) => ask(page, (el) => el.holds.find((hold) => hold.id === 12).type);
    await again.page.waitForFunction(() => document.querySelector("wall-topo").holds.some(({ type }) => type === "sloper"));
    assert.equal(await type(again.page), "sloper", "the first is kept");
    for (const tab of [...tabs, again]) await tab.close();
  },

  async "a link that is shared does not give the right to save"(browser, { edit }) {
    const { page, close } = await open(browser, edit);
    assert.match(edit, /token=/);
    assert.doesNotMatch(await ask(page, (wall) => wall.link()), /token/);
    await close();
    const plain = await open(browser, edit.split("?")[0]);
    assert.equal(await plain.page.locator("wall-topo").getByRole("button", { name: "Save", exact: true }).count(), 0);
    await plain.close();
  },
};
