// What a page of another origin, open in the same browser, can do to a scan that is served: nothing.

import assert from "node:assert/strict";
import { createServer } from "node:http";
import { test } from "./fixtures.mjs";

/** What such a page gets of each way to read or to write; runs in it. */
const attack = async ({ web, edit }) => {
  const load = (tag, source) =>
    new Promise((resolve) => {
      const element = document.createElement(tag);
      element.onload = () => resolve("got it");
      element.onerror = () => resolve("refused");
      element.src = source;
      document.body.append(element);
    });
  const send = (address, request) => fetch(address, request).then(() => "answered", () => "refused");
  const edits = JSON.stringify({ holds: { holds: [] }, routes: {} });
  const frame = document.createElement("iframe");
  const shown = new Promise((resolve) => (frame.onload = resolve));
  frame.src = web;
  document.body.append(frame);
  await shown;
  return {
    script: await load("script", `${web}page/first.js`),
    tiers: typeof window.wallTopoTiers,
    picture: await load("img", `${web}cutouts/1.png`),
    read: await send(`${web}routes.json`, {}),
    "read without looking": await send(`${web}routes.json`, { mode: "no-cors" }),
    "post as text": await send(`${edit}api/edits`, { method: "POST", mode: "no-cors", body: edits }),
    "post as JSON": await send(`${edit}api/edits`, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Walltopo-Token": "guess", "If-Match": '"-"' },
      body: edits,
    }),
  };
};

test("a page of another origin reads and writes nothing", async ({ browser, places: { web, edit } }) => {
  const server = createServer((_, answer) => {
    answer.writeHead(200, { "Content-Type": "text/html" }).end("<!doctype html><title>Other</title><body>");
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const places = { web, edit: edit.split("?")[0] };
  const context = await browser.newContext();
  try {
    // The first is of the same site (a browser does not count ports), the second of another.
    for (const host of ["127.0.0.1", "localhost"]) {
      const page = await context.newPage();
      await page.goto(`http://${host}:${server.address().port}/`);
      const seen = await page.evaluate(attack, places);
      const refused = Object.keys(seen).filter((way) => seen[way] === "refused" || seen[way] === "undefined");
      assert.deepEqual(refused, Object.keys(seen), JSON.stringify(seen));
      assert.equal(page.frames().length, 2);
      // A busy machine is a while between refusing an address and saying so.
      await page.frames()[1].waitForURL(({ href }) => /^(chrome-error|http):/.test(href), { waitUntil: "commit", timeout: 180_000 });
      assert.match(page.frames()[1].url(), /^chrome-error:/, "it is shown in a frame");
    }
  } finally {
    await context.close();
    server.close();
  }
});
