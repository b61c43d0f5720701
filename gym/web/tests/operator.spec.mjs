// The operator's pages: findings with what mends them, jobs, storage, accounts; after a proof of who one is.

import assert from "node:assert/strict";
import { readdirSync, readFileSync, statSync } from "node:fs";
import { join } from "node:path";
import { test } from "./fixtures.mjs";
import { answered, becomes, grave, OFFLINE, signIn, tooWide, visit } from "./place.mjs";

async function check(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

const row = (page, text) => page.getByRole("listitem").filter({ hasText: text });

/** A browser that an operator's other device let in: it has proved nothing yet. */
async function letIn(operator, other) {
  await operator.go("/");
  const offer = await operator.page.evaluate(async () => (await fetch("/api/v1/me/device-sign-ins", { method: "POST" })).json());
  await other.go("/selftest");
  const post = (page, path, body) =>
    page.evaluate(async ([to, content]) => {
      const given = await fetch(`/api/v1${to}`, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(content) });
      return given.status === 204 ? null : given.json();
    }, [path, body]);
  const { claim, code } = await post(other.page, "/session/device-sign-in/claim", { secret: offer.link.split("#")[1] });
  await post(operator.page, `/me/device-sign-ins/${offer.id}/allow`, { code });
  await post(other.page, "/session/device-sign-in", { secret: claim });
  await other.page.evaluate(() => localStorage.setItem("walltopo-signed-in", "yes"));
}

test("an operator finds what is wrong, and moves jobs", async ({ browser, places }) => {
  const known = await visit(browser, places);
  await signIn(known, places, places.operator);
  const operator = await visit(browser, places);
  operator.expected(answered(403));
  const { page, go } = operator;
  await letIn(known, operator);
  await known.close();

  // From one's account to the page, which asks for the password first.
  await go("/me");
  await page.getByRole("link", { name: "Server administration" }).click();
  await page.getByRole("dialog", { name: "Confirm it’s you" }).waitFor();
  await check(operator, "operator-confirm");
  await page.getByLabel("Password").fill("not the password");
  await page.getByRole("button", { name: "Confirm", exact: true }).click();
  await page.getByText("wrong password").waitFor();
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Confirm", exact: true }).click();
  await page.getByRole("dialog").waitFor({ state: "detached" });

  // Health: a finding with the line that mends it, the worker, the failed mail.
  await page.getByText('smtp_host = "mail.gym.example"').waitFor();
  await row(page, "worker-0").getByText("Running").waitFor();
  await page.getByText("the mail server refused the recipient: 550 unknown").waitFor();
  await check(operator, "operator-health");
  await page.getByText("the mail server refused the recipient: 550 unknown").scrollIntoViewIfNeeded();
  await operator.shot("operator-mails");

  // Jobs: the failed scan is queued again, and so is the job that was set aside.
  await page.getByRole("link", { name: "Jobs" }).click();
  await page.getByText("too few photos overlap").waitFor();
  await page.getByText("the file store is away (1 tries)").waitFor();
  await check(operator, "operator-jobs");
  await row(page, "the file store is away").getByRole("button", { name: "Retry" }).click();
  await page.getByText("the file store is away").waitFor({ state: "detached" });
  await row(page, "too few photos overlap").getByRole("button", { name: "Retry" }).click();
  await page.getByText("too few photos overlap").waitFor({ state: "detached" });

  // Storage: measured on demand.
  await page.getByRole("link", { name: "Storage" }).click();
  await page.getByRole("button", { name: "Measure now" }).click();
  await page.getByText(/^Files measured /).waitFor();
  await page.getByText("Working files of scans").first().waitFor();
  await check(operator, "operator-storage");
  await operator.close();
});

test("an operator finds an account, locks it and deletes it", async ({ browser, places }) => {
  const operator = await visit(browser, places, { phone: false });
  const { page, go } = operator;
  await signIn(operator, places, places.operator);
  await go("/operator/users");
  await page.getByLabel("Name or email").fill(places.stranger);
  await page.getByRole("button", { name: "Search" }).click();
  const account = row(page, places.stranger);
  await becomes(() => page.getByRole("listitem").filter({ hasText: "@example.com" }).count(), 1);
  await account.getByText("Manage").click();
  await check(operator, "operator-user");
  await account.getByRole("button", { name: "Lock account" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Lock account" }).click();
  await page.getByText("stranger is locked.").waitFor();

  // The person cannot sign in, and reads why.
  const stranger = await visit(browser, places);
  stranger.expected(answered(403));
  await stranger.go("/sign-in");
  await stranger.page.getByLabel("Email").fill(places.stranger);
  await stranger.page.getByLabel("Password").fill(places.password);
  await stranger.page.getByRole("button", { name: "Sign in", exact: true }).click();
  await stranger.page.getByText("this account is locked").waitFor();
  await check(stranger, "operator-locked");
  await stranger.close();
  assert.match(readFileSync(places.log, "utf8"), /Your account was locked/);

  // The export is a file; the account goes after its address is typed.
  const download = page.waitForEvent("download");
  await account.getByRole("button", { name: "Export data" }).click();
  const data = JSON.parse(readFileSync(await (await download).path(), "utf8"));
  assert.equal(data.account.email, places.stranger);
  const erase = account.getByRole("button", { name: "Delete account" });
  assert.ok(await erase.isDisabled());
  await account.getByLabel("Email of the account").fill(places.stranger);
  await erase.click();
  await page.getByText(`The account ${places.stranger} is deleted.`).waitFor();
  await page.getByText("No account matches.").waitFor();
  await operator.close();

  const phone = await visit(browser, places);
  await signIn(phone, places, places.operator);
  await phone.go("/operator/users");
  await phone.page.getByLabel("Name or email").fill(places.operator);
  await phone.page.getByRole("button", { name: "Search" }).click();
  await row(phone.page, places.operator).getByText("Manage").click();
  await phone.page.getByText("This is your own account").waitFor();
  await check(phone, "operator-users");
  await phone.close();
});

test("an operator makes a backup, tries it again and downloads it", async ({ browser, places }) => {
  const operator = await visit(browser, places);
  const { page, go } = operator;
  await signIn(operator, places, places.operator);
  await go("/operator/backups");
  await page.getByText(/^Every day at 03:07 UTC to /).waitFor();
  await check(operator, "operator-no-backups");
  await page.getByRole("button", { name: "Back up now" }).click();
  const backup = row(page, "walltopo-");
  await backup.getByText("Equal", { exact: true }).waitFor();
  await backup.getByText(/^[\d,]+ rows, [\d,]+ files/).waitFor();
  await check(operator, "operator-backups");
  await backup.getByRole("button", { name: "Try again" }).click();
  await page.getByRole("status").getByText(/^(Queued|Running|Trying the backup)$/).waitFor();
  await becomes(() => page.locator("main progress").count(), 0);
  const download = page.waitForEvent("download");
  await backup.getByRole("button", { name: "Download" }).click();
  const file = await download;
  assert.match(file.suggestedFilename(), /^walltopo-[0-9a-f]{8}-\d{8}T\d{6}Z\.tar$/);
  assert.ok(statSync(await file.path()).size > 10_000);
  await operator.close();
});

test("an operator limits a gym's storage and features", async ({ browser, places }) => {
  const operator = await visit(browser, places);
  const { page, go } = operator;
  await signIn(operator, places, places.operator);
  await go("/operator/gyms");
  const gym = row(page, "Storage quota and features").filter({ has: page.locator(`a[href="/g/${places.gym}"]`) });
  await gym.getByText("Storage quota and features").click();
  await gym.getByLabel("Storage quota in MB").fill("1");
  await gym.getByRole("checkbox", { name: "Insights" }).setChecked(false);
  await gym.getByRole("button", { name: "Save" }).click();
  await gym.getByText("Saved.").waitFor();
  await gym.getByText(/ of 1 MB used/).waitFor();
  await check(operator, "operator-gyms");
  await operator.close();

  const owner = await visit(browser, places);
  await signIn(owner, places, places.owner);
  await owner.go(`/g/${places.gym}/settings`);
  await owner.page.getByText("The operator of the server has turned some off.").waitFor();
  assert.ok(await owner.page.getByRole("checkbox", { name: "Insights" }).isDisabled());
  await owner.page.getByText(/ of 1 MB used/).scrollIntoViewIfNeeded();
  await check(owner, "gym-storage");
  await owner.close();
});

test("an announcement is shown to everybody until it is dismissed", async ({ browser, places }) => {
  const operator = await visit(browser, places);
  const { page, go } = operator;
  await signIn(operator, places, places.operator);
  await go("/operator/announcements");
  await page.locator("main").getByLabel("English").fill("The server is updated on Monday at 6.");
  await page.locator("main").getByLabel("Deutsch").fill("Am Montag um 6 wird der Server aktualisiert.");
  await check(operator, "operator-announce");
  await page.getByRole("button", { name: "Announce", exact: true }).click();
  await page.getByText("Announced.").waitFor();
  await operator.close();

  const guest = await visit(browser, places, { locale: "de" });
  await guest.go(`/g/${places.gym}`);
  const shown = guest.page.getByRole("complementary", { name: "Ankündigung" });
  await shown.getByText("Am Montag um 6").waitFor();
  await check(guest, "announcement");
  await shown.getByRole("button", { name: "Ausblenden" }).click();
  await shown.waitFor({ state: "detached" });
  await guest.page.reload();
  await guest.page.getByRole("heading", { level: 1 }).waitFor();
  await guest.page.waitForLoadState("networkidle");
  assert.equal(await shown.count(), 0);
  await guest.close();
});

test("others see no operator's page", async ({ browser, places }) => {
  const owner = await visit(browser, places);
  const { page, go } = owner;
  await signIn(owner, places, places.owner);
  await go("/me");
  assert.equal(await page.getByRole("link", { name: "Server administration" }).count(), 0);
  owner.expected(answered(403));
  await go("/operator");
  await page.getByText("Only operators of this server can open this page.").waitFor();
  await owner.close();
});

test("an empty server is restored from a backup", async ({ browser, places }) => {
  const { empty } = places;
  const newcomer = await visit(browser, { ...places, address: empty.address });
  const { page, go } = newcomer;
  newcomer.expected(OFFLINE, answered(422));
  await go("/setup#wrong");
  await page.getByRole("button", { name: "Continue" }).click();
  await page.getByText("the code is wrong").waitFor();
  await check(newcomer, "setup-code");
  const [, code] = /\/setup#(\S+)/.exec(readFileSync(empty.log, "utf8"));
  await page.getByLabel("Code").fill(code);
  await page.getByRole("button", { name: "Continue" }).click();
  const [name] = readdirSync(empty.backups).filter((each) => each.endsWith(".tar"));
  await page.getByRole("radio").first().waitFor();
  await check(newcomer, "setup-backups");
  await page.getByLabel("Or upload a backup").setInputFiles(join(empty.backups, name));
  await page.getByRole("button", { name: "Restore" }).click();
  await page.getByRole("heading", { name: "Sign in" }).waitFor();
  await page.getByLabel("Email").fill(places.owner);
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Sign in", exact: true }).click();
  await page.getByRole("heading", { name: "My gyms" }).waitFor();
  await newcomer.close();
});

// The last test of this file: it replaces the data that the others have made.
test("an operator restores a backup over the server", async ({ browser, places }) => {
  const operator = await visit(browser, places);
  const { page, go } = operator;
  operator.expected(OFFLINE);
  await signIn(operator, places, places.operator);
  await go("/operator/backups");
  const backup = row(page, "walltopo-").first();
  await backup.getByText("Restore", { exact: true }).click();
  const replace = backup.getByRole("button", { name: "Replace the server’s data" });
  assert.ok(await replace.isDisabled());
  await backup.getByLabel("Type localhost to confirm").fill("localhost");
  await check(operator, "operator-restore");
  await replace.click();
  await page.getByText("The server is being restored.").waitFor();
  await page.getByText(/ was restored /).waitFor();
  await check(operator, "operator-restored");
  await operator.close();
});
