// A member makes a list at a route, shares it, and sees what others climbed of it by their consent.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { grave, OFFLINE, signIn, tooWide, visit, wallDrawn } from "./place.mjs";

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

test("a list is made, shared, followed on the wall and done together", async ({ browser, places }) => {
  const author = await visit(browser, places);
  await signIn(author, places, places.member);
  const { page } = author;
  const gym = `/g/${places.gym}`;
  await author.go(`${gym}/w/${places.wall}`);
  const routes = await page.evaluate((path) => fetch(path).then((answer) => answer.json()), `/api/v1/gyms/${places.gym}/routes`);
  const [first, second] = routes.filter(({ wall_id, number }) => wall_id === places.wall && number !== null);

  // At a route: a new list; at the next one it is there.
  await author.go(`${gym}/w/${places.wall}/r/${first.id}`);
  await page.getByText("Add to a list", { exact: true }).click();
  await page.getByLabel("Name of a new list").fill("Homework");
  await page.getByRole("button", { name: "Create list" }).click();
  await page.getByText("Added to").waitFor();
  // Without reception it waits here, and arrives later.
  await author.go(`${gym}/w/${places.wall}/r/${second.id}`);
  await page.getByText("Add to a list", { exact: true }).click();
  await page.getByRole("button", { name: "Homework" }).waitFor();
  await author.context.setOffline(true);
  await page.getByRole("button", { name: "Homework" }).click();
  await page.getByText("Added to").waitFor();
  await page.getByText("Added to").scrollIntoViewIfNeeded();
  await check(author, "list-add");
  await page.getByRole("link", { name: "Homework" }).click();
  await page.getByText("Waiting to sync", { exact: true }).waitFor();
  await page.locator("ol a.item").nth(1).waitFor();
  await check(author, "list-waiting");
  await author.context.setOffline(false);
  await page.getByText("Waiting to sync", { exact: true }).waitFor({ state: "detached" });

  // Its order, note and people.
  const items = page.locator("ol a.item");
  const addresses = () => items.evaluateAll((links) => links.map((link) => link.getAttribute("href").split(/[/?]/).at(-2)));
  await items.nth(1).waitFor();
  assert.deepEqual(await addresses(), [first.id, second.id]);
  await page.getByRole("button", { name: "Edit list" }).click();
  await page.getByRole("button", { name: /^Move .* down$/ }).first().click();
  await page.getByLabel("Who sees it").selectOption({ label: "Everyone in this gym" });
  await page.getByLabel("Note").fill("Before Thursday");
  await check(author, "list-edit");
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByText("Before Thursday").waitFor();
  assert.deepEqual(await addresses(), [second.id, first.id]);
  const address = new URL(page.url()).pathname;

  // Another member finds it, follows it on the wall, and shows their progress.
  const other = await visit(browser, places);
  await signIn(other, places, places.judge);
  await other.go(gym);
  await other.page.getByRole("link", { name: "Lists", exact: true }).click();
  await other.page.getByRole("link", { name: "Homework" }).waitFor();
  await check(other, "lists");
  await other.page.getByRole("link", { name: "Homework" }).click();
  await other.page.getByRole("button", { name: "Do this list" }).click();
  await other.page.getByRole("checkbox", { name: /may see what I climbed/ }).check();
  await other.page.locator("ol a.item").first().click();
  await wallDrawn(other.page);
  const way = other.page.getByRole("navigation", { name: "Homework" });
  await way.getByText("1/2").waitFor();
  await check(other, "list-on-wall");
  await way.getByRole("link", { name: "Next" }).click();
  await way.getByText("2/2").waitFor();
  assert.ok(other.page.url().includes(first.id));
  const ticked = await other.page.evaluate(async ([path, route]) => {
    const body = JSON.stringify({ route_id: route, kind: "top", climbed_at: new Date().toISOString() });
    return (await fetch(`${path}/ascents/${crypto.randomUUID()}`, { method: "PUT", headers: { "content-type": "application/json" }, body })).status;
  }, [`/api/v1/gyms/${places.gym}`, first.id]);
  assert.equal(ticked, 201);
  await way.getByRole("link", { name: "Homework" }).click();
  await other.page.getByText("1 of 2 done").waitFor();

  await author.go(address);
  await page.getByRole("heading", { name: "Progress of the group" }).waitFor();
  await check(author, "list");
  // A name and a note that are written from right to left survive, and turn no sentence around.
  const [name, note] = ["تمارين (٣)", "قبل الخميس: ٣ مسارات!"];
  await page.getByRole("button", { name: "Edit list" }).click();
  await page.getByLabel("Name", { exact: true }).fill(name);
  await page.getByLabel("Note").fill(note);
  await check(author, "list-edit-arabic");
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByRole("heading", { name, level: 1 }).waitFor();
  await page.getByText(note).waitFor();
  await check(author, "list-arabic");
  await page.getByRole("button", { name: "Remove" }).click();
  await page.getByRole("dialog").getByText(`Delete “\u2068${name}\u2069”?`).waitFor();
  await author.shot("list-arabic-delete");
  await page.getByRole("dialog").getByRole("button", { name: "Remove" }).click();
  await page.getByRole("heading", { name: "Lists", level: 1 }).waitFor();
  await page.getByText("No lists yet.").waitFor();
  author.expected(OFFLINE);
  await author.close();
  await other.close();
});
