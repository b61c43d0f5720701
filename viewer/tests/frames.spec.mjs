// What must hold of the work that the viewer does: counted, so that a slow machine changes nothing.

import assert from "node:assert/strict";
import { ask, cells, fine, open, ready, settle, spread, tapHold } from "./browser.mjs";
import { test } from "./fixtures.mjs";

/** Counts frames that are asked for, draw calls, and bytes that go to the GPU. Runs before the page's scripts. */
function count() {
  window.frames_ = 0;
  window.uncountedFrame = window.requestAnimationFrame.bind(window);
  window.requestAnimationFrame = (step) => {
    window.frames_++;
    return window.uncountedFrame(step);
  };
  window.sent = [];
  window.draws = 0;
  const gl = WebGL2RenderingContext.prototype;
  for (const name of ["drawArrays", "drawElements"]) {
    const draw = gl[name];
    gl[name] = function (...rest) {
      window.draws++;
      return draw.apply(this, rest);
    };
  }
  for (const name of ["texImage2D", "texSubImage2D", "bufferData", "bufferSubData"]) {
    const send = gl[name];
    gl[name] = function (...rest) {
      const data = rest.find((value) => ArrayBuffer.isView(value) || value instanceof ImageBitmap);
      if (data) window.sent.push({ name, bytes: data.byteLength ?? data.width * data.height * 4 });
      return send.apply(this, rest);
    };
  }
}

/** Frames that the page requests during thirty turns: a slow machine takes longer for them, but makes as many. */
const framesRequested = (page) =>
  page.evaluate(async () => {
    const before = window.frames_;
    for (let turn = 0; turn < 30; turn++) await new Promise((resolve) => window.uncountedFrame(() => setTimeout(resolve)));
    return window.frames_ - before;
  });

/** Triangles and boxes that a search for ALL hits of a ray meets: more than picking ever does. */
const visited = (page, x, y) =>
  ask(
    page,
    (wall, [px, py]) => {
      const { clientWidth, clientHeight } = wall.shadowRoot.querySelector("canvas");
      const { stage } = wall;
      stage.pick(px, py);
      const { ray } = stage.ray;
      const [seen, point] = [{ boxes: 0, triangles: 0, of: 0 }, ray.origin.clone()];
      for (const tree of stage.picking.trees) {
        seen.of += tree.geometry.index.count / 3;
        tree.shapecast({
          intersectsBounds: (box) => (seen.boxes++, ray.intersectBox(box, point) !== null),
          intersectsTriangle: () => void seen.triangles++,
        });
      }
      return { ...seen, width: clientWidth, height: clientHeight };
    },
    [x, y],
  );

async function picksCheaply(page, least) {
  const canvas = await page.locator("wall-topo").locator("canvas").boundingBox();
  let most = 0;
  for (let k = 1; k <= 20; k++) {
    const x = canvas.width * ((0.5 + k * 0.7548776662) % 1);
    const y = canvas.height * ((0.5 + k * 0.569840291) % 1);
    const { boxes, triangles, of } = await visited(page, x, y);
    assert.ok(of >= least, `the model has ${of} triangles`);
    most = Math.max(most, boxes + triangles);
  }
  assert.ok(most > 10, "no ray met the wall");
  // A thousand boxes and triangles are some hundredths of a millisecond (tests/picking.mjs).
  assert.ok(most < 1000, `a ray met ${most} boxes and triangles`);
}

const STATES = 4096; // bytes of the texture that says what each hold looks like

test("no frame is asked for while nothing changes", async ({ browser, places: { disk } }) => {
  for (const motion of [false, true]) {
    const { page, log, close } = await open(browser, disk, { before: count, motion });
    await ready(page, "detail");
    await settle(page);
    assert.equal(await framesRequested(page), 0);
    const drawn = await ask(page, (wall) => wall.stage.frames);
    await page.mouse.move(600, 300);
    await page.mouse.wheel(0, -240);
    await page.waitForFunction((before) => document.querySelector("wall-topo").stage.frames > before, drawn, { polling: 50 });
    await settle(page);
    assert.equal(await framesRequested(page), 0);
    fine(log);
    await close();
  }
});

test("lighting a route is one texture write", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk, { before: count });
  await ready(page, "detail");
  await ask(page, (wall) => wall.selectRoute(1)); // the outline's own square goes over once
  await settle(page);
  await page.evaluate(() => (window.sent = []));
  await ask(page, (wall) => wall.selectRoute(2));
  await settle(page);
  assert.deepEqual(await page.evaluate(() => window.sent), [{ name: "texSubImage2D", bytes: STATES }]);
  await close();
});

// A frame that sends nothing and draws the wall in a handful of calls leaves 16 ms for the GPU's own work.
test("a problem among 2,000 holds is made and turned on the budget of a frame", async ({ browser, places: { odd } }) => {
  const { page, log, close } = await open(browser, odd.many, { before: count });
  await ready(page, "first");
  const use = await ask(page, (wall) => {
    const ids = wall.holds.map(({ id }) => id);
    const problem = (holds) => ({ holds, start: holds.slice(0, 2), top: holds.slice(-1), feet: holds.slice(2, 12) });
    window.problem = problem;
    wall.showHolds(problem(ids.slice(0, 60)));
    return { holds: ids.length };
  });
  assert.ok(use.holds >= 800, `only ${use.holds} holds`);
  await settle(page);
  // One more hold: the texture of looks goes over, and nothing else.
  await page.evaluate(() => (window.sent = []));
  await ask(page, (wall) => wall.showHolds(window.problem(wall.holds.map(({ id }) => id).slice(0, 61))));
  await settle(page);
  const sent = await page.evaluate(() => window.sent);
  assert.deepEqual(sent.map(({ name }) => name), ["texSubImage2D"]);
  assert.ok(sent[0].bytes <= STATES * Math.ceil((use.holds + 1) / 1024));
  // Turned: nothing goes over, and no frame touches more of the page than its flags.
  const turned = await ask(page, async (wall) => {
    window.sent = [];
    const { stage, shadowRoot } = wall;
    let touched = 0;
    const watch = new MutationObserver((records) => (touched += records.length));
    watch.observe(shadowRoot, { subtree: true, childList: true, attributes: true, characterData: true });
    const times = [];
    window.draws = 0;
    for (let k = 0; k < 30; k++) {
      wall.swing(k / 30);
      const begun = performance.now();
      stage.drawNow();
      times.push(performance.now() - begun);
      await new Promise((resolve) => setTimeout(resolve));
    }
    watch.disconnect();
    times.sort((a, b) => a - b);
    return { touched: touched / 30, calls: window.draws / 30, bytes: window.sent.length, ms: times[15] };
  });
  console.log(`scripts of a frame with ${use.holds} holds: ${turned.ms.toFixed(1)} ms in the median`);
  assert.equal(turned.bytes, 0);
  assert.ok(turned.calls >= 2 && turned.calls <= 12, `${turned.calls} draw calls a frame`);
  assert.ok(turned.touched <= 20, `${turned.touched} changes of the page a frame`);
  fine(log);
  await close();
});

test("a large picture goes to the GPU in pieces", async ({ browser, places: { quarters } }) => {
  const { page, log, close } = await open(browser, quarters.page, { before: count });
  const pieces = (await page.evaluate(() => window.sent)).filter(({ name, bytes }) => name === "texSubImage2D" && bytes !== STATES);
  const [width, height] = quarters.size;
  assert.equal(pieces.reduce((sum, { bytes }) => sum + bytes, 0), 4 * width * height);
  const most = Math.max(...pieces.map(({ bytes }) => bytes));
  assert.ok(most <= 2 ** 22, `a piece of ${most} bytes keeps the page from answering`);
  for (const [place, colour] of quarters.colours) {
    const drawn = await ask(
      page,
      async (wall, at) => {
        const shot = await createImageBitmap(await wall.screenshot());
        const pen = Object.assign(document.createElement("canvas"), { width: shot.width, height: shot.height }).getContext("2d");
        pen.drawImage(shot, 0, 0);
        const { x, y } = wall.project(at);
        return [...pen.getImageData(x, y, 1, 1).data].slice(0, 3);
      },
      place,
    );
    const off = Math.max(...colour.map((value, k) => Math.abs(value - drawn[k])));
    assert.ok(off < 12, `at ${place} the picture is ${colour}, drawn is ${drawn}`);
  }
  fine(log);
  await close();
});

test("a pick meets few triangles", async ({ browser, places: { disk } }) => {
  const { page, close } = await open(browser, disk);
  await picksCheaply(page, 1000);
  await close();
});

test("a model of five million triangles is drawn and picked", async ({ browser, places: { large, shots } }) => {
  const { page, log, close } = await open(browser, large);
  assert.ok(spread(await cells(page)) >= 2, "the picture is blank");
  const corners = [[0, 0, 0], [6, 0, 0], [6, 0, 4], [0, 0, 4]];
  const drawn = await ask(page, (wall, all) => all.map((place) => wall.project(place)), corners);
  const size = { x: 700, y: 700 }; // beside the list
  for (const at of drawn) for (const axis of ["x", "y"]) assert.ok(at[axis] > 0 && at[axis] < size[axis]);
  assert.equal(await ask(page, (wall) => wall.pickAt(350, 350)), 0);
  await picksCheaply(page, 5_000_000);
  await page.screenshot({ path: `${shots}/large-model.png` });
  fine(log);
  await close();
});

test("memory is given back when tiers change and when the element goes", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk);
  await ready(page, "detail");
  await tapHold(page, 5);
  const held = () => ask(page, (wall) => wall.stage.memory);
  const first = await held();
  for (let k = 0; k < 2; k++) {
    await ask(page, (wall) => {
      wall.removeAttribute("data-ready");
      wall.setAttribute("src", wall.getAttribute("src").replace(/^(\.\/)*/, "./$1"));
    });
    await ready(page, "detail");
    await tapHold(page, 5);
  }
  const isHeld = ({ geometries, textures }) => {
    const { memory } = document.querySelector("wall-topo").stage;
    return memory.geometries === geometries && memory.textures === textures;
  };
  await page.waitForFunction(isHeld, first).catch(async () => assert.deepEqual(await held(), first));
  const left = await ask(page, (wall) => {
    const { stage } = wall;
    wall.remove();
    return { ...stage.memory, gone: wall.stage };
  });
  assert.deepEqual(left, { geometries: 0, textures: 0, gone: null });
  fine(log);
  await close();
});

test("an element that is moved in its page works again", async ({ browser, places: { disk } }) => {
  const { page, log, close } = await open(browser, disk);
  await page.evaluate(() => {
    const wall = document.querySelector("wall-topo");
    const box = document.createElement("main");
    document.body.append(box);
    box.append(wall);
  });
  await ready(page, "detail");
  await tapHold(page, 5);
  assert.equal(await ask(page, (wall) => wall.selectedHold), 5);
  assert.ok(spread(await cells(page)) >= 4, "the picture is blank");
  fine(log);
  await close();
});
