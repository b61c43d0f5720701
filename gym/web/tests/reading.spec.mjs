// Each page for people who see little: text at twice the size, more contrast, the system's own colours; colours that look alike.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "./fixtures.mjs";
import { answered, grave, signIn, tooWide, until, visit, wallDrawn } from "./place.mjs";

const ROUTES = new URL("../src/routes.ts", import.meta.url);
// A session, a code of a printed card and a judge's link exist where somebody climbed, printed or made one: flows
// `climbing`, `hall` and `judging`.
const ELSEWHERE = /:visit|:code|:link|\*/;
// The same in each test: a repeated request changes nothing.
const MADE = [1, 2, 3].map((number) => `00000000-0000-4000-8000-00000000000${number}`);
const LOOKS = {
  phone: { contrast: "more" },
  "dark phone": { dark: true, contrast: "more" },
  laptop: { phone: false, forcedColors: "active" },
};

const api = (places) => `${places.address}/api/v1/gyms/${places.gym}`;

async function read(page, path) {
  const answer = await page.request.get(path);
  assert.ok(answer.ok(), `${path}: ${answer.status()}`);
  return answer.json();
}

async function made(page, places, method, path, data) {
  const answer = await page.request.fetch(`${api(places)}${path}`, { method, data, headers: { origin: places.address } });
  assert.ok(answer.ok(), `${path}: ${answer.status()} ${await answer.text()}`);
  return answer.json();
}

/** What stands behind the names in the addresses of the app's pages. */
async function things(page, places) {
  const [route] = (await read(page, `${api(places)}/routes`)).filter(({ wall_id, number }) => wall_id === places.wall && number !== null);
  const [list, problem, plan] = MADE;
  await made(page, places, "PUT", `/lists/${list}`, { name: "Homework", items: [route.id] });
  const uses = [{ hold: route.holds[0], use: "start" }, { hold: route.holds.at(-1), use: "top" }];
  await made(page, places, "PUT", `/problems/${problem}`, { wall_id: places.wall, scan_id: places.scan, name: "Mine", holds: uses });
  await made(page, places, "PUT", `/reset-plans/${plan}`, { wall_id: places.wall, day: "2099-01-01" });
  const cup = await made(page, places, "POST", "/competitions", {
    name: "Winter Cup", format: "rounds", categories: [{ name: "Open" }],
    rounds: [{ name: "Qualification", scoring: { rules: "ifsc-2025" }, problems: [{ name: "A" }] }],
  });
  const inspection = await made(page, places, "POST", "/inspections", { level: "visual", walls: [places.wall] });
  const me = await read(page, `${places.address}/api/v1/me`);
  return {
    gym: places.gym, wall: places.wall, scan: places.scan, route: route.id, list, problem, plan, inspection: inspection.id, year: "2026", person: me.id,
    competition: cup.id, judged: cup.rounds[0].problems[0].id,
  };
}

/** The addresses of all pages, with something behind each. */
function addresses(known) {
  const all = [...readFileSync(ROUTES, "utf8").matchAll(/^ {2}"(\/[^"]*)":/gm)].map(([, pattern]) => pattern);
  assert.ok(all.length > 70, `${all.length} pages are listed`);
  return all
    .filter((pattern) => !ELSEWHERE.test(pattern))
    .map((pattern) => pattern.replace("judge/:problem", "judge/:judged").replace(/:(\w+)/g, (_, name) => known[name] ?? assert.fail(pattern)));
}

for (const [name, look] of Object.entries(LOOKS)) {
  test(`each page at twice the text size, ${name}`, async ({ browser, places }) => {
    test.setTimeout(900_000);
    const owner = await visit(browser, places, { worker: false, ...look });
    await signIn(owner, places, places.owner);
    const { page } = owner;
    const findings = [];
    for (const path of addresses(await things(page, places))) {
      await page.goto(places.address + path);
      await page.waitForSelector("h1, main, .kiosk", { state: "attached" });
      await until(async () => !(await page.getByText("Loading…", { exact: true }).count()), `${path} is loaded`);
      await page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
      const wide = await tooWide(page);
      if (wide > 0) findings.push(`${path}: ${wide} pixels too wide`);
      // Colours of the system have the system's contrast, which axe does not know.
      const rules = look.forcedColors ? [] : ["color-contrast-enhanced"];
      findings.push(...(await grave(page, rules)).map((finding) => `${path}: ${finding}`));
    }
    owner.expected(answered("4\\d\\d")); // parts that an owner or a gym of this kind has not
    assert.equal(findings.join("\n"), "");
    await owner.close();
  });
}

test("colours that look alike have patterns", async ({ browser, places }) => {
  const climber = await visit(browser, places);
  const { page } = climber;
  await climber.go("/");
  await page.locator("footer").getByLabel("Colour vision").selectOption("deutan");
  await climber.go(`/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(page);
  const drawn = () =>
    page.locator("main li a").evaluateAll((rows) => rows.map((row) => getComputedStyle(row.querySelector(".swatch")).backgroundImage));
  const images = await drawn();
  const routes = await read(page, `${api(places)}/routes`);
  assert.equal(await page.locator("wall-topo").getAttribute("vision"), "deutan");
  const patterned = JSON.parse(readFileSync(new URL("../../../viewer/src/data/colour_vision.json", import.meta.url), "utf8")).deutan;
  const expected = routes.filter(({ wall_id, colour }) => wall_id === places.wall && (patterned[colour]?.pattern ?? 0) > 0).length;
  assert.equal(images.filter((image) => image !== "none").length, expected);
  assert.deepEqual(await grave(page), []);
  await climber.shot("deutan");
  await climber.close();
});

test("a list of holds follows the wall", async ({ browser, places }) => {
  const climber = await visit(browser, places, { phone: false });
  const { page } = climber;
  await climber.go(`/g/${places.gym}/w/${places.wall}`);
  await wallDrawn(page);
  const cursor = () =>
    page.evaluate(() => {
      const { stage, holds } = document.querySelector("wall-topo");
      return holds.map(({ id }) => id).filter((id) => stage.state.data[4 * id + 1] === 4);
    });
  const rows = page.locator("main li a");
  await rows.first().waitFor();
  await page.getByRole("searchbox").focus();
  for (let k = 0; k < 30 && !(await cursor()).length; k++) await page.keyboard.press("Tab");
  const outlined = await cursor();
  assert.ok(outlined.length > 1, "the wall does not show the focused route");
  await page.keyboard.press("Enter");
  await page.locator("main article").getByText("Holds in order", { exact: true }).click();
  const list = page.locator("main article details", { hasText: "Holds in order" }).getByRole("button");
  assert.equal(await list.count(), outlined.length);
  assert.match(await list.first().textContent(), /, Start, .*m$/);
  await list.first().focus();
  const [first] = await cursor();
  await page.keyboard.press("ArrowDown");
  const [second] = await cursor();
  assert.ok(first && second && first !== second);
  await page.keyboard.press("Enter");
  await page.waitForFunction((id) => document.querySelector("wall-topo").selectedHold === id, second);
  assert.deepEqual(await grave(page), []);
  await climber.shot("holds-in-order");
  await climber.close();
});
