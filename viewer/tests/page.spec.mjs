// What must hold of the page around the wall: filters, cards, words, what is saved and said.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { ask, colourfulness, fine, open, placeOf, ready, settle, tapHold, text } from "./browser.mjs";
import { test } from "./fixtures.mjs";

const PHONE = { width: 390, height: 844, phone: true };
const boxOf = (page, selector) =>
  ask(
    page,
    (wall, query) => {
      const { left, right, top, bottom } = wall.shadowRoot.querySelector(query).getBoundingClientRect();
      return { left, right, top, bottom };
    },
    selector,
  );
const apart = (a, b) => a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;

test("filters fade the wall too", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  const before = await colourfulness(page);
  await page.locator("wall-topo").locator('[data-colour="red"]').click();
  await settle(page);
  const red = new Set(
    await ask(page, (wall) => wall.routes.filter(({ colour }) => colour === "red").flatMap(({ holds }) => holds)),
  );
  for (const [id, { value }] of await colourfulness(page)) {
    const share = value / before.get(id).value;
    if (red.has(id)) assert.ok(share > 0.9, `red hold ${id} faded to ${share}`);
    else assert.ok(share < 0.3, `hold ${id} is filtered away and stayed at ${share}`);
  }
  await page.locator("wall-topo").locator('[data-colour="red"]').click();
  await settle(page);
  for (const [id, { value }] of await colourfulness(page)) assert.ok(value > 60, `hold ${id} did not come back`);
  await close();
});

test("a climber on a phone sees all holds over the card", async ({ browser, places: { disk, shots } }) => {
  const { page, close } = await open(browser, disk, PHONE);
  const routes = await ask(page, (wall) => wall.routes.map(({ id }) => id));
  for (const id of routes) {
    await ask(page, (wall, route) => wall.selectRoute(route), id);
    await ask(page, (wall) => wall.climberView());
    await settle(page);
    const card = await boxOf(page, ".card");
    const [left, right] = [0, 390];
    const seen = await ask(
      page,
      (wall, route) => {
        const { holds } = wall.routes.find(({ id }) => id === route);
        return holds.map((hold) => {
          const { size_m, position: [x, y, z] } = wall.holds.find(({ id }) => id === hold);
          return { hold, low: wall.project([x, y, z - size_m / 2]), high: wall.project([x, y, z + size_m / 2]) };
        });
      },
      id,
    );
    for (const { hold, low, high } of seen) {
      assert.ok(low.y < card.top, `route ${id}: hold ${hold} lies at ${low.y}, under the card at ${card.top}`);
      assert.ok(high.y > 58, `route ${id}: hold ${hold} lies at ${high.y}, under the buttons`);
      assert.ok(low.x > left && low.x < right, `route ${id}: hold ${hold} lies beside the picture`);
    }
  }
  await page.screenshot({ path: `${shots}/climber-phone.png` });
  await close();
});

test("words never lie under the edit bar", async ({ browser, places: { edit } }) => {
  for (const size of [PHONE, { width: 800, height: 700 }, { width: 1280, height: 720 }]) {
    const { page, close } = await open(browser, edit, size);
    await page.waitForFunction(() => document.querySelector("wall-topo").shadowRoot.querySelector(".edit"));
    await page.locator("wall-topo").getByRole("button", { name: "Measure (M)" }).click();
    const [toast, bar] = [await boxOf(page, ".toast.on"), await boxOf(page, ".edit")];
    assert.ok(apart(toast, bar), `${size.width}: the words at ${toast.top} lie under the bar to ${bar.bottom}`);
    await close();
  }
});

test("the whole wall is the whole wall", async ({ browser, places: { disk } }) => {
  for (const size of [{ width: 1280, height: 720 }, { width: 844, height: 390 }, PHONE]) {
    const { page, close } = await open(browser, disk, size);
    const { clientWidth, clientHeight } = await ask(page, (wall) => {
      const canvas = wall.shadowRoot.querySelector("canvas");
      return { clientWidth: canvas.clientWidth, clientHeight: canvas.clientHeight };
    });
    for (const corner of [[0, 0, 0], [6, 0, 0], [0, 0, 4], [6, 0, 4]]) {
      const { x, y } = await ask(page, (wall, place) => wall.project(place), corner);
      assert.ok(x >= 0 && x <= clientWidth && y >= 0 && y <= clientHeight, `${size.width}: ${corner} at ${x}, ${y}`);
    }
    await close();
  }
});

test("beside the list a card covers nothing of the wall", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk, { width: 1280, height: 720 });
  await tapHold(page, 5);
  assert.ok(apart(await boxOf(page, ".card"), await boxOf(page, "canvas")), "the card lies over the wall");
  const row = await boxOf(page, '[data-route="1"]');
  const card = await boxOf(page, ".card");
  assert.ok(apart(row, card), "the card lies over the first route of the list");
  await close();
});

test("a foothold has one name", async ({ browser, places: { odd } }) => {
  const { page, close } = await open(browser, odd.strange);
  await ask(page, (wall) => wall.selectHold(2));
  assert.match(await text(page, ".card"), /Foothold/);
  assert.equal(await ask(page, (wall) => wall.holds.find(({ id }) => id === 2).type), "foothold");
  await close();
});

test("a saved picture says start, top and name", async ({ browser, places: { disk, shots } }) => {
  const before = () => {
    window.written = [];
    const write = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, x, y, most) {
      window.written.push(text);
      write.call(this, text, x, y, most);
    };
  };
  const { page, log, close } = await open(browser, disk, { before });
  await ask(page, (wall) => wall.selectRoute(1, { move: true }));
  await settle(page);
  const [download] = await Promise.all([
    page.waitForEvent("download"),
    page.locator("wall-topo").getByRole("button", { name: "Save a picture" }).click(),
  ]);
  await download.saveAs(`${shots}/saved.png`);
  const written = await page.evaluate(() => window.written);
  const name = await text(page, '[data-route="1"] .name');
  for (const word of ["Start", "Top", name]) assert.ok(written.includes(word), `${word} is not among ${written}`);
  // The words are in the file, where the flag stands.
  const top = await ask(page, (wall) => wall.parts.overlay.flagged.find(({ kind }) => kind === "top"));
  const bytes = readFileSync(`${shots}/saved.png`).toString("base64");
  const dark = await page.evaluate(
    async ([data, x, y]) => {
      const picture = await createImageBitmap(await (await fetch(`data:image/png;base64,${data}`)).blob());
      const canvas = Object.assign(document.createElement("canvas"), { width: picture.width, height: picture.height });
      const pen = canvas.getContext("2d");
      pen.drawImage(picture, 0, 0);
      return [...pen.getImageData(x - 14, y - 28, 1, 1).data].slice(0, 3);
    },
    [bytes, top.x, top.y],
  );
  assert.ok(Math.max(...dark) < 60, `where the flag stands the picture is ${dark}`);
  fine(log);
  await close();
});

test("an embedded wall lets the page scroll", async ({ browser, places: { embed } }) => {
  for (const grab of [null, "two-fingers", "click", "always"]) {
    const { page, close } = await open(browser, embed);
    await page.evaluate((mode) => {
      document.body.append(Object.assign(document.createElement("div"), { style: "height:3000px" }));
      if (mode) document.querySelector("wall-topo").setAttribute("grab", mode);
    }, grab);
    const camera = () => ask(page, (wall) => wall.camera);
    const scrolled = () => page.evaluate(() => scrollY);
    const first = await camera();
    await page.mouse.move(400, 300);
    await page.mouse.wheel(0, 200);
    if (grab === "always") {
      await settle(page);
      assert.equal(await scrolled(), 0, "always: the page was scrolled");
      assert.notDeepEqual(await camera(), first, "always: the wheel moved nothing");
    } else {
      await page.waitForFunction(() => scrollY > 100);
      await settle(page);
      assert.deepEqual(await camera(), first, `${grab}: the wheel moved the wall too`);
      await page.evaluate(() => scrollTo(0, 0));
      await page.mouse.click(400, 300);
      await settle(page);
      const held = await camera();
      await page.mouse.wheel(0, 200);
      await page.waitForFunction((before) => JSON.stringify(document.querySelector("wall-topo").camera) !== before, JSON.stringify(held));
      assert.equal(await scrolled(), 0, `${grab}: held, and the page was scrolled`);
      await page.mouse.click(400, 600); // elsewhere: lets go
      await page.mouse.move(400, 300);
      await page.mouse.wheel(0, 200);
      await page.waitForFunction(() => scrollY > 100);
    }
    await close();
  }
});

test("one finger scrolls past an embedded wall, two move it", async ({ browser, places: { embed } }) => {
  const { page, close } = await open(browser, embed, { width: 820, height: 844, phone: true });
  await page.evaluate(() => document.body.append(Object.assign(document.createElement("div"), { style: "height:3000px" })));
  const client = await page.context().newCDPSession(page);
  const camera = () => ask(page, (wall) => wall.camera);
  const first = await camera();
  const send = (type, touchPoints) => client.send("Input.dispatchTouchEvent", { type, touchPoints });
  await send("touchStart", [{ x: 400, y: 400 }]);
  for (let k = 1; k <= 8; k++) {
    await send("touchMove", [{ x: 400, y: 400 - 30 * k }]);
    await settle(page);
  }
  await send("touchEnd", []);
  await page.waitForFunction(() => scrollY > 100);
  await settle(page);
  assert.deepEqual(await camera(), first, "one finger turned the wall");
  await page.evaluate(() => scrollTo(0, 0));
  await settle(page);
  const points = (by) => [{ x: 420 + by, y: 300 - by, id: 0 }, { x: 560 + by, y: 300 - by, id: 1 }];
  await send("touchStart", points(0));
  for (let k = 1; k <= 6; k++) {
    await send("touchMove", points(15 * k));
    await settle(page);
  }
  await send("touchEnd", []);
  await settle(page);
  assert.notDeepEqual(await camera(), first, "two fingers did not move the wall");
  assert.equal(await page.evaluate(() => scrollY), 0, "two fingers scrolled the page");
  await close();
});

test("a page of its own takes every touch", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk, PHONE);
  const at = await placeOf(page, 8);
  const before = await ask(page, (wall) => wall.camera);
  const client = await page.context().newCDPSession(page);
  const send = (type, touchPoints) => client.send("Input.dispatchTouchEvent", { type, touchPoints });
  await send("touchStart", [at]);
  for (let k = 1; k <= 6; k++) await send("touchMove", [{ x: at.x + 15 * k, y: at.y }]);
  await send("touchEnd", []);
  await settle(page);
  assert.notDeepEqual(await ask(page, (wall) => wall.camera), before, "a finger did not turn the wall");
  await close();
});

test("speaks the reader's language, or the one that its page asks for", async ({ browser, places: { disk, embed } }) => {
  const wanted = {
    de: [/Überhang/, /Jede Neigung/, /12 Griffe/, /^Rot 1$/],
    cs: [/převis/, /Jakýkoli sklon/, /12 chytů/, /^Červená 1$/],
    fr: [/dévers/, /Toute inclinaison/, /12 prises/, /^Rouge 1$/],
    pl: [/overhang/, /Any steepness/, /12 holds/, /^Red 1$/],
  };
  for (const [locale, [lean, filter, holds, name]] of Object.entries(wanted)) {
    const { page, log, close } = await open(browser, disk, { locale });
    assert.match(await text(page, ".filters"), filter);
    assert.match(await text(page, ".head p"), holds);
    assert.match(await text(page, '[data-route="1"] .name'), name);
    assert.match(await text(page, '[data-route="1"] .meta'), lean);
    fine(log);
    await close();
  }
  const prepare = (page) =>
    page.addInitScript(() =>
      new MutationObserver(() => document.querySelector("wall-topo")?.setAttribute("lang", "fr")).observe(document, { childList: true, subtree: true }),
    );
  const { page, close } = await open(browser, embed, { locale: "de", prepare });
  assert.equal(await ask(page, (wall) => wall.shadowRoot.querySelector(".shell").lang), "fr");
  assert.match(await text(page, ".head p"), /12 prises/);
  await close();
});

test("a lazy wall waits until it is near, behind its poster", async ({ browser, places: { lazy, shots } }) => {
  const { page, log, close } = await open(browser, lazy, { wait: false });
  await page.waitForFunction(() => document.querySelector("wall-topo").shadowRoot?.querySelector(".poster"));
  await page.waitForFunction(() => document.querySelector("wall-topo").shadowRoot.querySelector(".poster").naturalWidth === 8);
  await settle(page);
  const idle = await ask(page, (wall) => ({ canvas: wall.shadowRoot.querySelector("canvas"), stage: wall.stage }));
  assert.deepEqual(idle, { canvas: null, stage: null });
  assert.equal(await page.evaluate(() => performance.getEntriesByType("resource").filter(({ name }) => /first/.test(name)).length), 0);
  await page.evaluate(() => document.querySelector("wall-topo").scrollIntoView());
  await ready(page);
  assert.equal(await ask(page, (wall) => wall.shadowRoot.querySelector(".message").hidden), true);
  // Own buttons, own words under the card, own looks.
  const own = await page.evaluate(() => {
    const wall = document.querySelector("wall-topo");
    wall.selectRoute(1);
    const card = wall.shadowRoot.querySelector(".card");
    const shown = (selector) => document.querySelector(selector).getBoundingClientRect().height > 0;
    return [shown("#mine"), shown("#below"), getComputedStyle(card).backgroundColor];
  });
  assert.deepEqual(own, [true, true, "rgb(1, 2, 3)"]);
  await page.screenshot({ path: `${shots}/parts.png` });
  fine(log);
  await close();
});

test("an expected wall is read once, before its element is there", async ({ browser, places: { web } }) => {
  const address = new URL("ahead.html", web).href;
  const body = `<!doctype html><html lang="en"><title>Ahead</title><style>wall-topo{display:block;width:800px;height:500px}</style>
    <body><script src="page/viewer.js" data-worker="file"></script>
    <script>customElements.get("wall-topo").expect("page/first.glb")</script>`;
  const prepare = (page) => page.route(address, (route) => route.fulfill({ contentType: "text/html", body }));
  const { page, log, close } = await open(browser, address, { prepare, wait: false });
  const asked = () => performance.getEntriesByType("resource").filter(({ name }) => /first\.glb$/.test(name)).length;
  await page.waitForFunction(asked);
  assert.equal(await page.evaluate(() => document.querySelector("wall-topo")), null);
  await page.evaluate(() => {
    const wall = document.createElement("wall-topo");
    wall.setAttribute("src", "page/first.glb");
    wall.setAttribute("heading", "Ahead");
    document.body.append(wall);
  });
  await ready(page);
  assert.equal(await ask(page, (wall) => wall.routes.length), 4);
  assert.equal(await page.evaluate(asked), 1);
  assert.ok(page.workers().every((worker) => worker.url().endsWith("/page/viewer.js")), "the script's own file, as its tag asks for");
  // One that nobody waited for is dropped; what the element asks for is read.
  await ask(page, (wall) => {
    wall.constructor.expect("page/detail.glb");
    wall.setAttribute("src", "page/first.glb?again");
  });
  await ready(page);
  fine(log);
  await close();
});
