// What must hold of the viewer in a real browser. Each check throws, or gives what it saw.

import assert from "node:assert/strict";
import { ask, cells, colourfulness, fine, graveFindings, open, outside, ready, settle, spread, state, tapHold, text } from "./browser.mjs";
import { test } from "./fixtures.mjs";

test("opens from disk", async ({ browser, places: { disk, shots } }) => {
  const { page, log, close } = await open(browser, disk);
  await ready(page, "detail");
  assert.equal(await page.getAttribute("wall-topo", "data-ready"), "detail");
  assert.ok(spread(await cells(page)) >= 6, "the picture is blank");
  await page.screenshot({ path: `${shots}/desktop.png` });
  fine(log);
  await close();
});

test("opens from a server with a strict policy", async ({ browser, places: { web } }) => {
  const { page, log, close } = await open(browser, web);
  await ready(page, "detail");
  assert.equal(await page.getAttribute("wall-topo", "data-ready"), "detail");
  fine(log);
  await close();
});

test("a tap on a hold lights its route", async ({ browser, places: { disk, shots } }) => {
  const { page, log, close } = await open(browser, disk);
  const holds = await ask(page, (wall) => wall.holds.map(({ id, route }) => ({ id, route })));
  for (const { id, route } of [holds[1], holds[10], holds[6]]) {
    await tapHold(page, id);
    assert.deepEqual(await state(page), { route, hold: id });
    assert.match(await text(page, ".card"), new RegExp(`Hold ${id} `));
  }
  await page.screenshot({ path: `${shots}/hold.png` });
  fine(log);
  await close();
});

test("a lit route stays in colour and the rest fades", async ({ browser, places: { disk, shots } }) => {
  const { page, close } = await open(browser, disk);
  await ready(page, "detail");
  const before = await colourfulness(page);
  await ask(page, (wall) => wall.selectRoute(wall.routes[0].id));
  await settle(page);
  const after = await colourfulness(page);
  await page.screenshot({ path: `${shots}/route.png` });
  for (const [id, { route, value }] of before) {
    assert.ok(value > 60, `hold ${id} had no colour: ${value}`);
    const share = after.get(id).value / value;
    if (route === 1) assert.ok(share > 0.9, `hold ${id} is on the route and faded to ${share}`);
    else assert.ok(share < 0.3, `hold ${id} is not on the route and stayed at ${share}`);
  }
  const flags = await ask(page, (wall) =>
    [...wall.shadowRoot.querySelectorAll(".flag")].map((flag) => flag.textContent),
  );
  assert.deepEqual(flags.sort(), ["Start", "Top"]);
  await close();
});

test("routes can be stepped through and filtered", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  const ids = await ask(page, (wall) => wall.routes.map((route) => route.id));
  const wall = page.locator("wall-topo");
  await wall.locator(`[data-route="${ids[0]}"]`).click();
  assert.equal((await state(page)).route, ids[0]);
  await wall.getByRole("button", { name: "Next route" }).click();
  assert.equal((await state(page)).route, ids[1]);
  await wall.getByRole("button", { name: "Previous route" }).click();
  await wall.getByRole("button", { name: "Previous route" }).click();
  assert.equal((await state(page)).route, ids.at(-1));
  const rows = () => wall.locator("[data-route]").count();
  const all = await rows();
  await wall.locator('[data-colour="red"]').click();
  const red = await ask(page, (el) => el.routes.filter((route) => route.colour === "red").length);
  assert.equal(await rows(), red);
  await wall.getByLabel("Filter by steepness").selectOption("slab");
  assert.equal(await rows(), 0);
  assert.match(await text(page, ".empty"), /No routes match/);
  await wall.locator('[data-colour="red"]').click();
  await wall.getByLabel("Filter by steepness").selectOption("");
  assert.equal(await rows(), all);
  await close();
});

test("a link leads to route, hold and camera", async ({ browser, places: { disk } }) => {
  const first = await open(browser, disk);
  await tapHold(first.page, 5);
  const link = await ask(first.page, (wall) => wall.link());
  await first.close();
  const { page, close } = await open(browser, link);
  const route = await ask(page, (wall) => wall.holds.find((hold) => hold.id === 5).route);
  assert.deepEqual(await state(page), { route, hold: 5 });
  assert.equal(await ask(page, (wall) => wall.link()), link);
  await page.evaluate(() => (location.hash = "#route=1"));
  await page.waitForFunction(() => document.querySelector("wall-topo").selectedHold === null);
  assert.equal((await state(page)).route, 1);
  await page.evaluate(() => (location.hash = "#route=<b>&hold=1e9&cam=1,2,x"));
  await settle(page);
  await close();
});

test("works by keyboard alone", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk);
  const ids = await ask(page, (wall) => wall.routes.map((route) => route.id));
  const focused = () =>
    ask(page, (wall) => wall.shadowRoot.activeElement?.getAttribute("data-route") ?? null);
  for (let k = 0; k < 40 && (await focused()) === null; k++) await page.keyboard.press("Tab");
  assert.equal(await focused(), String(ids[0]));
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  assert.equal((await state(page)).route, ids[1]);
  const onCanvas = () => ask(page, (wall) => wall.shadowRoot.activeElement?.tagName === "CANVAS");
  for (let k = 0; k < 60 && !(await onCanvas()); k++) await page.keyboard.press("Tab");
  assert.ok(await onCanvas(), "the picture cannot be reached by Tab");
  await page.keyboard.press("]");
  assert.equal((await state(page)).route, ids[2]);
  const before = await ask(page, (wall) => wall.link());
  await page.keyboard.press("ArrowLeft");
  await settle(page);
  assert.notEqual(await ask(page, (wall) => wall.link()), before);
  await page.keyboard.press("Escape");
  assert.equal((await state(page)).route, null);
  fine(log);
  await close();
});

test("each hold is reached and selected by keys", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk);
  await ask(page, (wall) => wall.shadowRoot.querySelector("canvas").focus());
  const said = () => ask(page, (wall) => wall.shadowRoot.querySelector("[role=status]").textContent);
  await page.keyboard.press("Shift+ArrowRight");
  assert.match(await said(), /\d (cm|m)$/, "nobody hears how high the hold is");
  const first = await said();
  await page.keyboard.press("Shift+ArrowRight");
  assert.notEqual(await said(), first);
  await page.keyboard.press("Enter");
  const { hold, route } = await state(page);
  assert.ok(hold > 0);
  assert.equal(route, await ask(page, (wall, id) => wall.holds.find((each) => each.id === id).route ?? null, hold));
  // To the left of it, as it is drawn.
  await settle(page);
  await page.keyboard.press("Shift+ArrowLeft");
  await page.keyboard.press("Space");
  const next = (await state(page)).hold;
  const [from, to] = await ask(page, (wall, ids) => ids.map((id) => wall.project(id).x), [hold, next]);
  assert.ok(to < from, `${next} lies at ${to}, not left of ${from}`);
  fine(log);
  await close();
});

test("fits a phone and a large screen", async ({ browser, places: { disk, shots } }) => {
  for (const [name, options] of Object.entries({
    phone: { width: 390, height: 844, phone: true, dark: true },
    landscape: { width: 844, height: 390, phone: true },
    large: { width: 1920, height: 1080, dark: true },
  })) {
    const { page, log, close } = await open(browser, disk, options);
    assert.deepEqual(await outside(page), [], `${name}: holds outside the picture`);
    await page.screenshot({ path: `${shots}/${name}-home.png` });
    await ask(page, (wall) => wall.selectRoute(wall.routes[1].id, { move: true }));
    await settle(page);
    await page.screenshot({ path: `${shots}/${name}.png` });
    // not innerWidth: a phone's browser counts what stands over into it
    const wide =
      (await page.evaluate(() => document.documentElement.scrollWidth)) - options.width;
    assert.ok(wide <= 0, `${name}: the page is ${wide} px too wide`);
    const room = await ask(page, (wall) => {
      const box = wall.shadowRoot.querySelector("canvas").getBoundingClientRect();
      return (box.width * box.height) / (innerWidth * innerHeight);
    });
    assert.ok(room > 0.5, `${name}: the wall has ${room} of the screen`);
    fine(log);
    await close();
  }
});

test("taps on a phone", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk, { width: 390, height: 780, phone: true });
  const at = await ask(page, (wall) => wall.project(8));
  await page.touchscreen.tap(at.x, at.y);
  await settle(page);
  assert.equal((await state(page)).hold, 8);
  await close();
});

test("survives a lost context", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  await ready(page, "detail");
  await ask(page, (wall) => wall.selectRoute(2));
  await settle(page);
  const before = await cells(page);
  assert.ok(spread(before) >= 4, "the picture is blank");
  await ask(page, (wall) => {
    wall.interrupted = [];
    for (const type of ["webglcontextlost", "webglcontextrestored"]) {
      wall.shadowRoot.querySelector("canvas").addEventListener(type, () => wall.interrupted.push(type));
    }
    const gl = wall.shadowRoot.querySelector("canvas").getContext("webgl2");
    wall.lost = gl.getExtension("WEBGL_lose_context");
    wall.lost.loseContext();
  });
  // Seen in a turn of its own: a context may not come back in the event that took it.
  await page.waitForFunction(() => document.querySelector("wall-topo").interrupted.length === 1);
  await ask(page, (wall) => wall.lost.restoreContext());
  await page.waitForFunction(() => document.querySelector("wall-topo").interrupted.length === 2);
  await page.waitForFunction(() => !document.querySelector("wall-topo").stage.blank);
  await settle(page);
  const after = await cells(page);
  const seen = await ask(page, (wall) => wall.interrupted);
  assert.deepEqual(seen, ["webglcontextlost", "webglcontextrestored"]);
  const off = before.reduce((sum, v, k) => sum + Math.abs(v - after[k]), 0) / before.length;
  assert.ok(off < 3, `the picture differs by ${off} a channel after the context came back`);
  await close();
});

test("a broken file gives a message", async ({ browser, places: { broken, shots } }) => {
  for (const url of broken) {
    const { page, close } = await open(browser, url, { fails: true });
    assert.match(await text(page, "[role=alert]"), /could not be loaded/);
    assert.match(await text(page, ".message"), /Try again/);
    await page.screenshot({ path: `${shots}/broken.png` });
    await close();
  }
});

test("a model beyond memory gives a message", async ({ browser, places: { endless } }) => {
  const { page, close } = await open(browser, endless, { fails: true });
  assert.match(await text(page, "[role=alert]"), /needs more memory than this browser has/);
  await close();
});

test("models without ids, without holds, with 2000 holds, with strange tables", async ({ browser, places: { odd, shots } }) => {
  for (const [kind, url] of Object.entries(odd)) {
    const { page, log, close } = await open(browser, url);
    assert.notEqual(await page.getAttribute("wall-topo", "data-ready"), "error", kind);
    const count = await ask(page, (wall) => wall.holds.length);
    assert.equal(count, { many: 2000, strange: 2 }[kind] ?? 0, kind);
    if (kind === "strange") {
      assert.deepEqual(await ask(page, (wall) => wall.routes.map(({ id, holds }) => [id, holds])), [[8, [1, 2]]]);
      await tapHold(page, 1);
      assert.equal((await state(page)).hold, 1);
    } else if (kind === "many") {
      await tapHold(page, 1234);
      assert.equal((await state(page)).hold, 1234);
    } else {
      assert.match(await text(page, ".side"), /No holds were found/);
      assert.ok(spread(await cells(page)) >= 2, `${kind}: the picture is blank`);
      await page.screenshot({ path: `${shots}/${kind}.png` });
    }
    fine(log);
    await close();
  }
});

test("markup in names stays text", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk);
  await ask(page, (wall) => wall.selectRoute(2));
  await settle(page);
  assert.match(await text(page, ".card h3"), /<img src=x onerror=/);
  assert.match(await text(page, '[data-route="2"] .name'), /<b>Owl<\/b>/);
  assert.equal(await page.evaluate(() => window.hacked), undefined);
  fine(log);
  await close();
});

test("measures", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  const [a, b] = [1, 3];
  const [true_, at] = await ask(
    page,
    (wall, ids) => {
      const [p, q] = ids.map((id) => wall.holds.find((hold) => hold.id === id).position);
      return [Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]), ids.map((id) => wall.project(id))];
    },
    [a, b],
  );
  const box = await page.locator("wall-topo").locator("canvas").boundingBox();
  await page.locator("wall-topo").getByRole("button", { name: "Measure (M)" }).click();
  for (const { x, y } of at) {
    await page.mouse.click(box.x + x, box.y + y);
    await page.waitForTimeout(350); // not a double click
  }
  const shown = parseFloat(await text(page, ".length"));
  assert.ok(Math.abs(shown - true_) < 0.04, `${shown} m measured, ${true_} m in truth`);
  await close();
});

test("a climber stands in front of the start", async ({ browser, places: { disk, shots } }) => {
  const { page, close } = await open(browser, disk);
  await ask(page, (wall) => {
    wall.selectRoute(1);
    wall.climberView();
  });
  await settle(page);
  const hash = new URL(await ask(page, (wall) => wall.link())).hash;
  const eye = new URLSearchParams(hash.slice(1)).get("cam").split(",").map(Number);
  assert.ok(Math.abs(eye[2] - 1.65) < 0.3, `eyes at ${eye[2]} m`);
  assert.ok(eye[1] < -1 && eye[1] > -6, `${-eye[1]} m in front of the wall`);
  const seen = await ask(page, (wall) => {
    const low = wall.shadowRoot.querySelector("canvas").clientHeight; // the card lies beside it
    const route = wall.routes.find(({ id }) => id === 1);
    return route.holds.map((id) => wall.project(id).y / low);
  });
  assert.ok(seen.every((share) => share > 0 && share < 1), `holds at ${seen} of the free height`);
  await page.screenshot({ path: `${shots}/climber.png` });
  await close();
});

test("the camera stays above the mat and in front of the wall", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  const canvas = await page.locator("wall-topo").locator("canvas").boundingBox();
  const middle = { x: canvas.x + canvas.width / 2, y: canvas.y + canvas.height / 2 };
  for (const [dx, dy] of [[0, -900], [1500, 0], [-3000, 0], [0, 900]]) {
    await page.mouse.move(middle.x, middle.y);
    await page.mouse.down();
    for (let k = 1; k <= 6; k++) await page.mouse.move(middle.x + (dx * k) / 6, middle.y + (dy * k) / 6);
    await page.mouse.up();
    await settle(page);
    const hash = new URL(await ask(page, (wall) => wall.link())).hash;
    const eye = new URLSearchParams(hash.slice(1)).get("cam").split(",").map(Number);
    assert.ok(eye[2] > 0.1, `the camera is ${eye[2]} m over the mat`);
    assert.ok(eye[1] < 0, `the camera is behind the wall: y = ${eye[1]}`);
  }
  await close();
});

test("has no serious accessibility findings", async ({ browser, places: { disk, report } }) => {
  for (const [url, options] of [
    [disk, {}],
    [disk, { width: 390, height: 844, dark: true }],
    [disk, { width: 844, height: 390 }],
    [report, {}],
    [report, { dark: true }],
  ]) {
    const { page, close } = await open(browser, url, { ...options, wait: url === disk });
    assert.deepEqual(await graveFindings(page), []);
    if (url === disk) {
      await ask(page, (wall) => wall.selectHold(5));
      await settle(page);
      assert.deepEqual(await graveFindings(page), []);
    }
    await close();
  }
});

test("tells its page what was chosen", async ({ browser, places: { embed } }) => {
  const { page, log, close } = await open(browser, embed);
  await ask(page, (wall) => wall.selectHold(4));
  const heard = await page.evaluate(() => window.heard);
  assert.deepEqual(heard.map((event) => event.type), ["wall-load", "hold-select", "route-select"]);
  assert.equal(heard[1].detail.hold.id, 4);
  fine(log);
  await close();
});

test("the example page works", async ({ browser, places: { example, shots } }) => {
  const { page, log, close } = await open(browser, example);
  await tapHold(page, 4);
  assert.match(await page.locator("#said").textContent(), /^Route 2: 3 holds/);
  await page.screenshot({ path: `${shots}/example.png` });
  fine(log);
  await close();
});
