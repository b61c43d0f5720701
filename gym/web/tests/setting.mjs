// The setter's way: an account, a gym, a wall, photos, a scan that is begun and cancelled.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { join } from "node:path";
import { mailed, visit } from "./place.mjs";

export const setting = {
  async "from signing up to photos on their way"(browser, places) {
    const visitor = await visit(browser, places);
    const { page, go, shot, context } = visitor;
    await go("/sign-up");
    await page.getByLabel("E-mail").fill("sam@example.com");
    await page.getByRole("button", { name: "Mail me the link" }).click();
    const secret = await mailed(places, "/sign-up");
    await go(`/sign-up#${secret}`);
    // The same page with another hash is not loaded anew.
    await page.reload();
    await page.getByLabel("Name", { exact: true }).fill("Sam");
    await page.getByLabel("Password").fill(places.password);
    await page.getByRole("button", { name: "Make account" }).click();
    await page.getByRole("link", { name: "Open a gym" }).click();
    await page.getByLabel("Name", { exact: true }).fill("Sam's hall");
    await page.getByRole("button", { name: "Open the gym" }).click();
    await page.getByRole("link", { name: "Settings" }).click();
    await page.getByText("Add a grade system").first().click();
    await page.getByRole("button", { name: "Add a grade system" }).click();
    await page.getByText("Yellow – Black").waitFor();
    await shot("settings");
    await page.getByRole("link", { name: "People" }).click();
    await page.getByRole("button", { name: "Make a link" }).click();
    await page.getByRole("img", { name: "QR code" }).waitFor();
    await shot("people");
    await page.getByRole("link", { name: "Walls" }).click();
    await page.getByLabel("Name of the wall").fill("Cave");
    await page.getByRole("button", { name: "Add a wall" }).click();
    await page.getByRole("link", { name: "Cave" }).first().click();
    await page.getByRole("button", { name: "New photos" }).click();

    // Two photos do not get through; then the tab is closed.
    const photos = readdirSync(places.photos).sort().slice(0, 5).map((name) => join(places.photos, name));
    let sent = 0;
    await context.route("**/photos/*", (route) => {
      const isData = route.request().method() === "PATCH";
      return isData && ++sent > 3 ? route.abort() : route.continue();
    });
    await page.setInputFiles("input[type=file]", photos);
    await page.waitForFunction(() => document.querySelectorAll("main li img").length === 3);
    await context.unroute("**/photos/*");
    visitor.log.length = 0; // the broken connections
    await page.reload();
    // Without choosing them again: the browser has kept them.
    await page.getByText("5 usable photos").waitFor();
    assert.equal(await page.locator("main li img").count(), 5);
    // What is none is said, and can be taken back.
    await page.setInputFiles("input[type=file]", { name: "note.jpg", mimeType: "image/jpeg", buffer: Buffer.from("a note") });
    await page.locator("li.bad .reason").waitFor();
    await shot("photos");
    await page.getByRole("button", { name: "Remove note.jpg" }).click();
    await page.locator("li.bad").waitFor({ state: "detached" });

    await page.getByRole("button", { name: "Make the wall" }).click();
    // At work: the list of stages is there, in words.
    await page.locator("ol li[aria-current=step]").waitFor();
    await shot("progress");
    await page.getByRole("button", { name: "Cancel" }).click();
    await page.getByText("This was cancelled.").waitFor();
    await page.getByRole("button", { name: "Start again" }).waitFor();
    await page.getByRole("link", { name: "Versions" }).click();
    await page.getByText("Cancelled", { exact: true }).waitFor();
    await visitor.close();
  },
};
