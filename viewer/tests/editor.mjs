// A page in edit mode.

import { ask, open } from "./browser.mjs";

export const hold = (page, id) => ask(page, (el, number) => el.holds.find((one) => one.id === number) ?? null, id);
export const route = (page, id) => ask(page, (el, number) => el.routes.find((one) => one.id === number) ?? null, id);

/** Whose the surface is at a point of the page. */
export const under = (page, at) =>
  ask(
    page,
    (el, { x, y }) => {
      const box = el.shadowRoot.querySelector("canvas").getBoundingClientRect();
      return el.pickAt(x - box.left, y - box.top);
    },
    at,
  );

/** Wait until the server has previewed the last edit and the result is drawn. */
export async function previewed(page) {
  const done = () => {
    const bar = document.querySelector("wall-topo").shadowRoot.querySelector(".edit");
    return bar?.getAttribute("aria-busy") === "false";
  };
  await page.waitForFunction(done, null, { timeout: 180_000, polling: 50 });
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => setTimeout(resolve))));
}

/** A page in edit mode, once it knows what the saved log does. */
export async function editor(browser, edit, size = {}) {
  const opened = await open(browser, edit, { width: 1200, height: 800, ...size });
  const { page } = opened;
  await page.waitForFunction(() => document.querySelector("wall-topo").parts.editor, null, { timeout: 180_000 });
  await previewed(page);
  const wall = page.locator("wall-topo");
  const press = async (name) => {
    await wall.getByRole("button", { name, exact: true }).click();
    await previewed(page);
  };
  const pick = async (label, option) => {
    await wall.getByLabel(label, { exact: true }).selectOption(option);
    await previewed(page);
  };
  const write = async (label, value) => {
    await wall.getByLabel(label, { exact: true }).fill(value);
    await wall.getByLabel(label, { exact: true }).blur();
    await previewed(page);
  };
  const saved = (words = "All changes saved") =>
    page.waitForFunction(
      (text) => document.querySelector("wall-topo").shadowRoot.querySelector(".edit [role=status]").textContent.includes(text),
      words,
      { timeout: 180_000 },
    );
  return { ...opened, wall, press, pick, write, saved };
}
