// One network for all flows of an engine and a browser for each, with what is in the gym (`WALLTOPO_PLACES`). WebKitGTK's storage may
// stop answering after several pages with broken connections; a new browser has its own.

import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { test as base } from "@playwright/test";
import { button, field, open } from "./driver.mjs";
import { Network } from "./network.mjs";

export const test = base.extend({
  engine: [null, { option: true, scope: "worker" }],
  places: [async ({}, use) => use(JSON.parse(readFileSync(process.env.WALLTOPO_PLACES, "utf8"))), { scope: "worker" }],
  network: [async ({ places }, use) => {
    const network = await new Network().listen(places);
    await use(network);
    await network.close();
  }, { scope: "worker" }],
  /** A guest's page. */
  visitor: async ({ engine, places, network }, use, info) => {
    network.set("open");
    const page = await open(engine, places.address);
    await use(page);
    const name = `${engine}-${info.title.replace(/\W+/g, "-").slice(0, 40)}`;
    if (info.status !== info.expectedStatus) writeFileSync(join(places.shots, `${name}.png`), await page.screenshot());
    await page.end();
  },
  /** The page of a person who climbs and sets; another's in a second try, as sign-ins are limited. */
  page: async ({ places, visitor }, use, info) => {
    await visitor.go("/sign-in");
    await visitor.fill(field("Email"), info.retry ? places.owner : places.setter);
    await visitor.fill(field("Password"), places.password);
    await visitor.click(button("Sign in"));
    await visitor.says("My gyms");
    await use(visitor);
  },
});
