// Photos taken in the browser: a camera, three photos, warnings, what overlaps, and no camera at all.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { LAUNCH } from "../../../viewer/tests/browser.mjs";
import { test } from "./fixtures.mjs";
import { grave, mailed, tooWide, visit } from "./place.mjs";

const CAMERA = ["--use-fake-device-for-media-stream", "--use-fake-ui-for-media-stream"];
test.use({ launchOptions: { ...LAUNCH, args: [...LAUNCH.args, ...CAMERA] } });

/** A gym of one's own with a wall whose first scan waits for photos; returns the scan's address. */
async function newScan({ page, go }, places, name) {
  const email = `${name}@example.com`;
  await go("/sign-up");
  await page.getByLabel("Email").fill(email);
  await page.getByRole("button", { name: "Email me a link" }).click();
  await page.getByText(email).first().waitFor();
  await go(`/sign-up#${await mailed(places, "/sign-up")}`);
  await page.reload(); // the same page with another hash is not loaded anew
  await page.getByLabel("Name", { exact: true }).fill("Cam");
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Create account" }).click();
  await page.getByRole("link", { name: "New gym" }).click();
  await page.getByLabel("Name", { exact: true }).fill(`Hall of ${name}`);
  await page.getByRole("button", { name: "Create gym" }).click();
  await page.getByLabel("Wall name").fill("Slab");
  await page.getByRole("button", { name: "Add wall" }).click();
  await page.getByRole("link", { name: "Slab" }).first().click();
  await page.getByRole("button", { name: "New scan" }).click();
  await page.getByRole("button", { name: "Take photos" }).waitFor();
  return new URL(page.url()).pathname;
}

/** The photos of the scan as the server lists them. */
async function onServer(page, path) {
  const [, , gym, , scan] = path.split("/");
  return (await page.request.get(`${new URL(page.url()).origin}/api/v1/gyms/${gym}/scans/${scan}/photos`)).json();
}

/** Replace the camera by a canvas that shows `window.shown`, a picture's address, or black. Runs in the page. */
function cameraOfPictures() {
  const canvas = Object.assign(document.createElement("canvas"), { width: 1280, height: 960 });
  const pen = canvas.getContext("2d");
  const picture = new Image();
  /** Show a picture; resolves ten frames of the page's video later, which show it. */
  window.show = async (address) => {
    picture.src = address;
    await picture.decode();
    const video = document.querySelector("dialog video");
    for (let frame = 0; frame < 10; frame++) await new Promise((wake) => video.requestVideoFrameCallback(wake));
  };
  setInterval(() => {
    pen.fillRect(0, 0, canvas.width, canvas.height);
    if (picture.naturalWidth) pen.drawImage(picture, 0, 0, canvas.width, canvas.height);
  }, 50);
  navigator.mediaDevices.getUserMedia = async () => canvas.captureStream(20);
  delete window.ImageCapture; // the frame of the video, as on an iPhone
}

test("photos go from the camera into the queue, with warnings and hints", async ({ browser, places }, { retry }) => {
  const begun = Date.now();
  const visitor = await visit(browser, places);
  const { page, go, shot } = visitor;
  const path = await newScan(visitor, places, `cam${retry}`);
  await page.getByRole("button", { name: "Take photos" }).click();
  const shutter = page.getByRole("button", { name: "Take photo", exact: true });
  for (let count = 1; count <= 3; count++) {
    await shutter.click();
    await page.getByText(count === 1 ? "1 photo" : `${count} photos`, { exact: true }).waitFor();
  }
  await page.getByRole("img", { name: "Last photo" }).waitFor();
  assert.deepEqual(await grave(page), []);
  assert.ok((await tooWide(page)) <= 0);
  await page.getByRole("button", { name: "Done" }).click();
  await page.waitForFunction(() => document.querySelectorAll("main ul li").length === 3);
  const photos = await onServer(page, path);
  assert.equal(photos.length, 3);
  assert.ok(photos.every(({ name }) => name.startsWith("camera-")), JSON.stringify(photos));
  while (await page.getByRole("button", { name: /^Remove camera-/ }).count()) {
    const left = await page.locator("main ul li").count();
    await page.getByRole("button", { name: /^Remove camera-/ }).first().click();
    await page.waitForFunction((before) => document.querySelectorAll("main ul li").length < before, left);
  }

  // A camera that sees the wall, then nothing.
  await page.addInitScript(cameraOfPictures);
  await go(path);
  await page.getByRole("button", { name: "Take photos" }).click();
  await page.getByText("Too dark: switch on more light").waitFor();
  await page.getByText("Blurred: hold still").waitFor();
  await page.setViewportSize({ width: 360, height: 740 });
  await shot("capture-dark");
  const names = readdirSync(places.photos).sort().slice(0, 3);
  for (const [number, name] of names.entries()) {
    await page.evaluate((address) => window.show(address), `data:image/jpeg;base64,${readFileSync(join(places.photos, name)).toString("base64")}`);
    await page.getByText("Too dark: switch on more light").waitFor({ state: "detached" });
    await shutter.click();
    await page.getByText(number === 0 ? "1 photo" : `${number + 1} photos`, { exact: true }).waitFor();
  }
  await page.getByRole("group", { name: /overlap/ }).waitFor();
  await page.getByText(/The scale plate/).waitFor();
  await shot("capture-strip");
  assert.deepEqual(await grave(page), []);
  assert.ok((await tooWide(page)) <= 0);
  await page.setViewportSize({ width: 740, height: 360 });
  await shot("capture-landscape");
  assert.ok(await shutter.isVisible());

  // No camera: the page says what to do, and the file chooser sends to the same queue.
  await page.addInitScript(() => {
    navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("no", "NotAllowedError"));
  });
  await page.setViewportSize({ width: 390, height: 844 });
  await go(path);
  await page.getByText("3 usable photos").waitFor();
  await page.getByRole("button", { name: "Take photos" }).click();
  await page.getByText("The camera is blocked for this site.").waitFor();
  await shot("capture-refused");
  assert.deepEqual(await grave(page), []);
  const other = readdirSync(places.photos).sort()[3];
  await page.locator("dialog input[type=file]").setInputFiles(join(places.photos, other));
  await page.getByText("1 photo", { exact: true }).waitFor();
  await page.getByRole("button", { name: "Done" }).click();
  await page.getByText("4 usable photos").waitFor();
  assert.equal((await onServer(page, path)).length, 4);
  console.log(`capture: ${((Date.now() - begun) / 1000).toFixed(1)} s`);
  await visitor.close();
});
