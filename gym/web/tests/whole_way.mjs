// node whole_way.mjs PLACES.json: from signing up to the climbers' view, in one go. Prints one JSON line per part, with its seconds;
// `gym/benchmarks/whole_way.py` starts the server and adds up.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { start } from "../../../viewer/tests/browser.mjs";
import { mailed, nameRoutes, visit, wallDrawn } from "./place.mjs";

// A scan takes minutes; nothing else does.
const SCAN_MS = 3_600_000;

const places = JSON.parse(readFileSync(process.argv[2], "utf8"));
const photos = readdirSync(places.photos).sort().map((name) => join(places.photos, name));
const browser = await start();
const setter = await visit(browser, places);
const { page, go } = setter;

// A server may refuse and the app retry: failed requests are printed at the end.
const refused = [];
page.on("response", (response) => {
  if (response.status() >= 400) refused.push(`${response.status()} ${response.request().method()} ${new URL(response.url()).pathname}`);
});

async function part(name, act) {
  const began = Date.now();
  const result = await act();
  process.stdout.write(`${JSON.stringify({ name, seconds: (Date.now() - began) / 1000, result })}\n`);
}

await part("sign up", async () => {
  await go("/sign-up");
  await page.getByLabel("Email").fill("sam@example.com");
  await page.getByRole("button", { name: "Email me a link" }).click();
  await go(`/sign-up#${await mailed(places, "/sign-up")}`);
  // The same page with another hash is not loaded anew.
  await page.reload();
  await page.getByLabel("Name", { exact: true }).fill("Sam");
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Create account" }).click();
  await page.getByRole("link", { name: "New gym" }).waitFor();
});

await part("gym", async () => {
  await page.getByRole("link", { name: "New gym" }).click();
  await page.getByLabel("Name", { exact: true }).fill("Sam's hall");
  await page.getByRole("button", { name: "Create gym" }).click();
  await page.getByRole("link", { name: "Settings" }).click();
  await page.getByText("Add grade system").first().click();
  await page.getByLabel("Kind").selectOption("v"); // Font is there from the start
  await page.getByRole("button", { name: "Add grade system" }).click();
  await page.getByRole("listitem").filter({ hasText: "V scale" }).first().waitFor();
});

await part("wall", async () => {
  await page.goBack();
  await page.getByLabel("Wall name").fill("Cave");
  await page.getByRole("button", { name: "Add wall" }).click();
  await page.getByRole("link", { name: "Cave" }).first().click();
  await page.getByRole("button", { name: "New scan" }).click();
  await page.waitForSelector("input[type=file]", { state: "attached" });
});

await part("photos", async () => {
  await page.setInputFiles("input[type=file]", photos);
  await page.getByText(`${photos.length} usable photos`).waitFor();
  return `${photos.length} photos`;
});

await part("scan", async () => {
  await page.getByRole("button", { name: "Start scan" }).click();
  await page.locator("ol li[aria-current=step]").waitFor();
  const stages = new Set();
  // Progress texts are for people; here it is enough that they change.
  for (const end = Date.now() + SCAN_MS; ; await page.waitForTimeout(250)) {
    assert.ok(Date.now() < end, "the scan takes too long");
    const step = page.locator("ol li[aria-current=step]");
    if ((await step.count()) === 0) break;
    stages.add(await step.innerText({ timeout: 1000 }).catch(() => ""));
  }
  stages.delete("");
  const failure = page.locator(".failed");
  assert.equal(await failure.count(), 0, (await failure.allInnerTexts()).join());
  await page.locator("[data-field=name]").first().waitFor();
  assert.ok(stages.size > 5, `the page showed ${stages.size} steps`);
});

let rows = 0;
await part("review", async () => {
  await wallDrawn(page);
  rows = await nameRoutes(page);
  return `${rows} routes named`;
});

await part("publish", async () => {
  await page.getByRole("button", { name: "Publish" }).click();
  await page.getByText("This version is published.").waitFor();
});

await part("a climber sees it", async () => {
  const climber = await visit(browser, places);
  await climber.go("/");
  await climber.page.getByRole("link", { name: "Sam's hall" }).first().click();
  await climber.page.getByRole("link", { name: "Cave" }).first().click();
  await wallDrawn(climber.page);
  await climber.page.getByRole("link", { name: /^Moon 1\b/ }).first().waitFor();
  await climber.page.getByText("6A").filter({ visible: true }).first().waitFor();
  await climber.shot("whole-way");
  await climber.close();
});

await part("refused on the way", async () => refused.map((line) => line.replace(/[0-9a-f-]{36}/g, "…")).join(", ") || "nothing");
setter.expected(/Failed to load resource/);
await setter.close();
await browser.close();
