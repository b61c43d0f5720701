// A clip of an attempt: sent over a broken connection, read, corrected, confirmed; it then counts with those of others.

import assert from "node:assert/strict";
import { mkdtempSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

const ROUTE = 2; // which the climber of the clip tops

/** The address of the route of the clip. */
async function filmedRoute(page, { gym, wall }) {
  const version = await page.evaluate((path) => fetch(path).then((answer) => answer.json()), `/api/v1/gyms/${gym}/walls/${wall}/published`);
  const route = version.routes.find(({ number }) => number === ROUTE);
  return `/g/${gym}/w/${wall}/r/${route.id}`;
}

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

/** Wait until a film shows its first picture. */
async function played(page, name) {
  const film = page.getByLabel(name).and(page.locator("video"));
  await film.scrollIntoViewIfNeeded();
  await film.evaluate((video) => video.play());
  await page.waitForFunction(() => [...document.querySelectorAll("video")].some(({ videoWidth, currentTime }) => videoWidth > 0 && currentTime > 0));
}

const ascents = (page, { gym }) => page.evaluate(async (path) => (await (await fetch(path)).json()).ascents.length, `/api/v1/me/data?gym=${gym}`);

test("a clip becomes the beta that one confirms", async ({ browser, places }) => {
  const member = await visit(browser, places, { worker: false }); // which would hide the broken connection
  const { page, go, context } = member;
  await signIn(member, places, places.member);
  await go(await filmedRoute(page, places));
  await wallDrawn(page);
  await page.getByText("How others climb it").click();
  await page.getByText("Shown once three climbers have confirmed a clip.").waitFor();
  await page.getByText("Add your clip").click();
  const choose = page.getByLabel("Choose a video");
  await page.getByText("at most 60 seconds").waitFor();

  // A file that is no video is sent, refused in words, and discarded.
  const text = join(mkdtempSync(join(tmpdir(), "clip-")), "notes.mp4");
  writeFileSync(text, "no video");
  await choose.setInputFiles(text);
  await page.getByText("This file cannot be played as a video.").scrollIntoViewIfNeeded();
  await check(member, "clip-refused");
  await page.getByRole("button", { name: "Discard" }).click();
  await page.getByText("This file cannot be played as a video.").waitFor({ state: "detached" });

  // The first piece is lost; the rest of the way goes on by itself.
  let lost = 0;
  await context.route("**/clips/*", (route) => (route.request().method() === "PATCH" && lost++ === 0 ? route.abort() : route.continue()));
  member.expected(OFFLINE);
  await page.getByLabel("Make a film that I can publish").setChecked(true);
  await choose.setInputFiles(places.clip);
  await page.getByText(/^(Sent\. Waiting|Analysis:)/).waitFor();
  assert.ok(lost > 1);
  await page.getByText(/^Analysis: following/).waitFor();
  await check(member, "clip-reading");

  // What was read: a question, a correction, and a confirmation.
  const question = page.getByRole("heading", { name: /^Top of Moon 2 in \d+ moves\?$/ });
  await question.waitFor();
  await question.scrollIntoViewIfNeeded();
  await check(member, "clip-read");
  const moves = page.getByRole("listitem").filter({ hasText: /\d s / });
  const before = await moves.count();
  await moves.first().getByRole("button").click();
  await page.getByLabel("Hold, counted from the ground").selectOption({ label: "Hold 1" });
  await moves.nth(1).getByRole("button").first().click();
  await page.getByRole("button", { name: "Remove", exact: true }).click();
  await moves.nth(1).getByText("removed").waitFor();
  await check(member, "clip-corrected");
  await page.getByRole("button", { name: "Confirm", exact: true }).click();
  await page.getByText("Confirmed. It counts at the route").waitFor();
  assert.equal(await moves.count(), before - 1);
  await moves.first().getByText("Hold 1").waitFor();

  // A figure climbs it on the wall, as it was confirmed; the model's are beside it.
  await page.getByRole("button", { name: "Replay on the wall" }).click();
  const climber = page.getByLabel("Climber", { exact: true });
  await climber.waitFor();
  assert.equal(await climber.inputValue(), "clip");
  await check(member, "clip-replayed");
  await page.getByRole("button", { name: "Hide the figure" }).last().click();
  await climber.waitFor({ state: "detached" });

  // The film is one's own until it is published.
  await played(page, "Your film");
  const publish = page.getByRole("button", { name: "Publish", exact: true });
  assert.ok(await publish.isDisabled());
  await page.getByLabel("I am 16 or older").setChecked(true);
  await publish.scrollIntoViewIfNeeded();
  await check(member, "clip-film");
  await publish.click();
  await page.getByText("Published at the route, with your name.").waitFor();

  // Nothing is logged until the form is saved.
  assert.equal(await ascents(page, places), 0);
  await page.getByText("Log this as an ascent").click();
  assert.equal(await page.getByLabel("Result").inputValue(), "top");
  await page.getByLabel("Result").scrollIntoViewIfNeeded();
  await check(member, "clip-log");
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("Ascent logged.").waitFor();
  await page.getByRole("heading", { name: "My ascents" }).waitFor();

  // With the two climbers of the fixture, the sequences of three show.
  await page.reload();
  await wallDrawn(page);
  await page.getByText("How others climb it").click();
  await page.getByText("From 3 climbers.").scrollIntoViewIfNeeded();
  await page.getByText("Most used orders of the hands").waitFor();
  await check(member, "clip-beta");
  const onWall = page.getByRole("button", { name: "Show on the wall", exact: true });
  await onWall.click();
  await page.getByText("everybody").waitFor();
  await page.locator("wall-topo").scrollIntoViewIfNeeded();
  await member.shot("clip-heat");
  await onWall.click();
  await page.getByText("everybody").waitFor({ state: "hidden" });
  await member.close();
});

test("guests see the beta and the films alone, and nobody sees clips that the owner switched off", async ({ browser, places }) => {
  const guest = await visit(browser, places);
  await guest.go(`/g/${places.gym}`);
  const address = await filmedRoute(guest.page, places);
  await guest.go(address);
  await guest.page.getByText("How others climb it").waitFor();
  assert.equal(await guest.page.getByText("Add your clip").count(), 0);
  await guest.page.getByText("How others climb it").click();
  await played(guest.page, /^Film by /);
  await check(guest, "clip-films");
  await guest.close();

  // Somebody else reports it; the setter removes it.
  const judge = await visit(browser, places);
  await signIn(judge, places, places.judge);
  await judge.go(address);
  await judge.page.getByText("How others climb it").click();
  await judge.page.getByRole("button", { name: "Report", exact: true }).first().click();
  await judge.page.getByText("Reported. The gym decides.").waitFor();
  await judge.close();

  const owner = await visit(browser, places, { phone: false });
  const { page, go } = owner;
  await signIn(owner, places, places.owner);
  await go(address);
  await page.getByText("Add your clip").click();
  await page.getByText("at most 60 seconds").waitFor();
  await check(owner, "clip");
  await go(`/g/${places.gym}/settings/comments`);
  await page.getByRole("button", { name: "Remove the film" }).scrollIntoViewIfNeeded();
  await check(owner, "clip-reports");
  await page.getByRole("button", { name: "Remove the film" }).click();
  await page.getByText("No reported films.").waitFor();
  await go(`/g/${places.gym}/settings`);
  await page.getByRole("checkbox", { name: "Clips of attempts" }).setChecked(false);
  await page.getByRole("button", { name: "Save", exact: true }).click();
  await page.getByText("Saved").waitFor();
  await go(address);
  await page.getByText("Add to a list").waitFor();
  assert.equal(await page.getByText("How others climb it").count(), 0);
  await owner.close();
});
