// An inspection: its plan, marks of holds and items on a phone without reception, a photo, the signed record, its check.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { becomes, grave, OFFLINE, signIn, stored, tooWide, visit, wallDrawn } from "./place.mjs";

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

const read = (page, path) => page.evaluate((address) => fetch(address, { cache: "no-store" }).then((answer) => answer.json()), `/api/v1${path}`);

/** Tap a hold of the wall by the viewer's own event: where it is on the screen depends on the camera. */
function tapHold(page, hold) {
  return page.evaluate((id) => {
    const wall = document.querySelector("wall-topo");
    wall.dispatchEvent(new CustomEvent("hold-tap", { detail: { hold: { id } }, bubbles: true, composed: true }));
  }, hold);
}

/** Let the server of this page refuse photos, as above the gym's quota; the service worker sends nothing meanwhile. */
function refusePhotos() {
  const send = window.fetch;
  const body = JSON.stringify({ title: "the gym's storage is full", hint: "Ask the operator for more." });
  Object.defineProperty(ServiceWorkerRegistration.prototype, "sync", { value: undefined });
  window.fetch = (what, how) => (String(what.url ?? what).endsWith("/photos") ? Promise.resolve(new Response(body, { status: 413 })) : send(what, how));
}

test("a round of the wall becomes a signed record", async ({ browser, places }) => {
  const owner = await visit(browser, places);
  const { page, go, context } = owner;
  const { gym, wall } = places;
  await signIn(owner, places, places.owner);

  // The plan is a proposal until it is saved; then the inspections are due, also on the setters' page.
  await go(`/g/${gym}/inspections`);
  await page.getByText("No plan is saved yet").waitFor();
  await page.getByRole("link", { name: "Plan and checklists" }).click();
  await page.getByText("This is a proposal.").waitFor();
  await page.getByLabel("Days between inspections of a wall").nth(1).fill("60");
  await check(owner, "inspection-plan");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("Saved").waitFor();
  await go(`/g/${gym}/desk`);
  await page.getByRole("heading", { name: "Inspections due" }).waitFor();
  await check(owner, "inspections-on-desk");
  await page.getByRole("link", { name: "Go to inspections" }).click();
  await page.getByText("Due", { exact: true }).first().waitFor();
  await check(owner, "inspections-due");
  await page.getByRole("button", { name: "Begin", exact: true }).first().click();
  await check(owner, "inspection-begin");
  await page.getByRole("region", { name: "New inspection" }).getByRole("button", { name: "Begin" }).click();

  // A reported hold is shown at the wall.
  await page.getByRole("heading", { name: "Reported holds" }).waitFor();
  await wallDrawn(page);
  const inspection = new URL(page.url()).pathname.split("/").at(-1);
  await stored(page, `/api/v1/gyms/${gym}/inspections/${inspection}`);
  await page.getByRole("button", { name: "Hold 1: It spins" }).click();
  await page.getByRole("button", { name: "History of this hold" }).or(page.getByText("History of this hold")).first().click();
  await page.getByText("First scan with this hold").waitFor();
  await check(owner, "inspection-hold");

  // Without reception: a mark with a photo, a defect, and a mark that is replaced.
  await context.setOffline(true);
  owner.expected(OFFLINE);
  await page.getByText("Note and photo").click();
  await page.getByLabel("Note", { exact: true }).fill("half a turn");
  await page.getByLabel("Take a photo").setInputFiles(places.photo);
  await page.getByRole("img", { name: "Photo" }).waitFor();
  await page.getByRole("group", { name: "Hold 1" }).getByRole("button", { name: "Tightened" }).click();
  await page.getByText("1 mark waiting to sync").waitFor();
  await page.getByRole("heading", { name: "Reported holds" }).waitFor({ state: "detached" });
  await tapHold(page, 2);
  const second = page.getByRole("group", { name: "Hold 2" });
  await second.getByRole("button", { name: "Fine" }).click();
  await second.getByRole("button", { name: "Washed" }).click();
  await page.getByRole("button", { name: "Close", exact: true }).click();
  const items = page.getByRole("listitem").filter({ has: page.getByRole("button", { name: "Not checked" }) });
  await items.first().getByRole("button", { name: "Defect" }).click();
  await items.first().getByLabel("Note").fill("a gap of 3 cm");
  await check(owner, "inspection-defect");
  await page.getByRole("button", { name: "Save defect" }).click();
  await items.nth(1).getByRole("button", { name: "Fine" }).click();
  await page.getByText("5 marks waiting to sync").waitFor();
  assert.ok(await page.getByRole("button", { name: "Finish and sign" }).isDisabled());
  await check(owner, "inspection-offline");

  // With reception all of it arrives, once, and the report is closed.
  await context.setOffline(false);
  const path = `/gyms/${gym}/inspections/${inspection}`;
  await becomes(async () => (await read(page, path)).entries.length, 5);
  const { entries } = await read(page, path);
  assert.deepEqual(entries.map(({ mark }) => mark), ["tightened", "fine", "washed", "defect", "fine"]);
  assert.equal(entries.filter(({ photo }) => photo).length, 1);
  assert.deepEqual(await read(page, `/gyms/${gym}/hold-reports`), []);

  await page.getByText("waiting to sync").waitFor({ state: "detached" });

  // A mark whose photo is refused still counts here, and nothing is signed without it.
  await page.evaluate(refusePhotos);
  await items.nth(2).getByRole("button", { name: "Defect" }).click();
  await items.nth(2).getByLabel("Note").fill("a loose bolt");
  await items.nth(2).getByLabel("Take a photo").setInputFiles(places.photo);
  await items.nth(2).getByRole("img", { name: "Photo" }).waitFor();
  await page.getByRole("button", { name: "Save defect" }).click();
  await page.getByText("A mark was refused").scrollIntoViewIfNeeded();
  assert.ok(await page.getByRole("button", { name: "Finish and sign" }).isDisabled());
  await check(owner, "inspection-refused");
  await page.getByRole("alert").getByRole("link", { name: "1 change was rejected" }).click();
  await page.getByText("storage is full").waitFor();
  await check(owner, "inspection-refused-waiting");
  await page.getByRole("button", { name: "Send without photo" }).click();
  await becomes(async () => (await read(page, path)).entries.length, 6);
  await go(`/g/${gym}/inspections/${inspection}`);

  // A defect cannot pass; the end signs the record.
  assert.ok(await page.getByLabel("Passed", { exact: true }).isDisabled());
  await page.getByLabel("Passed with defects").setChecked(true);
  await page.getByLabel("Remarks").fill("Mats ordered.");
  await page.getByRole("button", { name: "Finish and sign" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Finish and sign" }).click();
  await page.getByRole("region", { name: "Record" }).waitFor();
  await page.getByRole("img", { name: "Photo" }).scrollIntoViewIfNeeded();
  await page.waitForFunction(() => [...document.querySelectorAll('img[alt="Photo"]')].every(({ naturalWidth }) => naturalWidth > 0));
  await page.getByRole("region", { name: "Record" }).scrollIntoViewIfNeeded();
  await check(owner, "inspection-record");
  const pdf = await context.request.get(`${places.address}/api/v1${path}/record.pdf`);
  assert.equal(pdf.headers()["content-type"], "application/pdf");

  // A mark that another phone sends now is late, and shown as such.
  const late = { wall_id: wall, item: 2, mark: "defect", note: "found later" };
  const sent = await context.request.put(`${places.address}/api/v1${path}/entries/${crypto.randomUUID()}`, { data: late, headers: { origin: places.address } });
  assert.equal(sent.status(), 201);
  await page.reload();
  await page.getByRole("heading", { name: "Arrived after the end" }).waitFor();
  await page.getByText("found later").scrollIntoViewIfNeeded();
  await check(owner, "inspection-late");

  // Anybody checks the code, and learns no name.
  const { code } = await read(page, path);
  const stranger = await visit(browser, places);
  await stranger.go(`/verify/${code}`);
  await stranger.page.getByText("its signature is valid").waitFor();
  await stranger.page.getByText("1 mark arrived after the end").waitFor();
  await check(stranger, "inspection-verify");
  await stranger.close();

  // A correction is an inspection of its own.
  await page.getByRole("button", { name: "Correct", exact: true }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Correct", exact: true }).click();
  await page.getByRole("button", { name: "Finish and sign" }).waitFor();
  await wallDrawn(page);
  await check(owner, "inspection-correction");

  // Climbers see that a wall is closed.
  await page.getByLabel("Closed to climbers").setChecked(true);
  await page.getByRole("button", { name: "Finish and sign" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Finish and sign" }).click();
  await page.getByRole("region", { name: "Record" }).waitFor();
  const climber = await visit(browser, places);
  await climber.go(`/g/${gym}`);
  await climber.page.getByText("Closed to climbers since").waitFor();
  await check(climber, "closed-gym");
  await climber.go(`/g/${gym}/w/${wall}`);
  await climber.page.getByText("Closed to climbers since").waitFor();
  await wallDrawn(climber.page);
  await check(climber, "closed-wall");
  await climber.close();
  await go(`/g/${gym}/inspections`);
  await page.getByText("Correction").waitFor();
  await check(owner, "inspections");
  await owner.close();
});
