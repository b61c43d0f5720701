// The setter's way: an account, a gym, a wall, photos, a scan that is started and cancelled.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "./fixtures.mjs";
import { mailed, OFFLINE, visit } from "./place.mjs";

/** Let three photos through and break the connection of the others, until the page is opened again. Runs in the page. */
function cutAfterThree() {
  const { open, send } = XMLHttpRequest.prototype;
  let sent = 0;
  XMLHttpRequest.prototype.open = function (method, address, ...rest) {
    this.isPhoto = method === "PATCH" && String(address).includes("/photos/");
    open.call(this, method, address, ...rest);
  };
  XMLHttpRequest.prototype.send = function (body) {
    if (this.isPhoto && ++sent > 3) setTimeout(() => this.dispatchEvent(new ProgressEvent("error")));
    else send.call(this, body);
  };
}

test("from signing up to photos on their way", async ({ browser, places }) => {
  const visitor = await visit(browser, places);
  const { page, go, shot } = visitor;
  await go("/sign-up");
  await page.getByLabel("Email").fill("sam@example.com");
  await page.getByRole("button", { name: "Email me a link" }).click();
  const secret = await mailed(places, "/sign-up");
  await go(`/sign-up#${secret}`);
  // The same page with another hash is not loaded anew.
  await page.reload();
  await page.getByLabel("Name", { exact: true }).fill("Sam");
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Create account" }).click();
  await page.getByRole("link", { name: "New gym" }).click();
  await page.getByLabel("Name", { exact: true }).fill("Sam's hall");
  await page.getByRole("button", { name: "Create gym" }).click();
  await page.getByRole("link", { name: "Settings" }).click();
  await page.getByText("Add grade system").first().click();
  await page.getByRole("button", { name: "Add grade system" }).click();
  await page.getByText("Yellow – Black").waitFor();
  await shot("settings");
  await page.getByRole("link", { name: "People" }).click();
  await page.getByRole("button", { name: "Create link" }).click();
  await page.getByRole("img", { name: "QR code" }).waitFor();
  await shot("people");
  await page.getByRole("link", { name: "Walls" }).click();
  await page.getByLabel("Wall name").fill("Cave");
  await page.getByRole("button", { name: "Add wall" }).click();
  await page.getByRole("link", { name: "Cave" }).first().click();
  await page.getByRole("button", { name: "New scan" }).click();

  // The scale plate is there to print before any photo is taken.
  await page.getByText("Lay it flat on the floor").waitFor();
  const plate = await page.request.get(places.address + (await page.getByRole("link", { name: "Print on A4", exact: true }).getAttribute("href")));
  assert.equal(plate.headers()["content-type"], "application/pdf");
  await shot("new-scan");

  // Two photos do not get through; then the tab is closed.
  const photos = readdirSync(places.photos).sort().slice(0, 5).map((name) => join(places.photos, name));
  await page.evaluate(cutAfterThree); // Playwright's own interception crashes pages that a service worker opens
  await page.setInputFiles("input[type=file]", photos);
  await page.waitForFunction(() => document.querySelectorAll("main li img").length === 3);
  visitor.expected(OFFLINE);
  await page.reload();
  // Without choosing them again: the browser has kept them.
  await page.getByText("5 usable photos").waitFor();
  assert.equal(await page.locator("main li img").count(), 5);
  // An unusable file is reported and can be removed.
  await page.setInputFiles("input[type=file]", { name: "note.jpg", mimeType: "image/jpeg", buffer: Buffer.from("a note") });
  await page.locator("li.bad .reason").waitFor();
  await shot("photos");
  await page.getByRole("button", { name: "Remove note.jpg" }).click();
  await page.locator("li.bad").waitFor({ state: "detached" });

  await page.getByRole("button", { name: "Start scan" }).click();
  // Running: the list of stages is there, in words.
  await page.locator("ol li[aria-current=step]").waitFor();
  await shot("progress");
  await page.getByRole("button", { name: "Cancel" }).click();
  await page.getByText("Cancelled. Finished").waitFor();
  await page.getByRole("button", { name: "Retry" }).waitFor();
  await page.getByRole("link", { name: "Versions" }).click();
  await page.getByText("Cancelled", { exact: true }).waitFor();
  await visitor.close();
});
