// One's account: ways to sign in, visibility, export, deletion; a wall through time; a gym that becomes private.

import assert from "node:assert/strict";
import { createHmac } from "node:crypto";
import { test } from "./fixtures.mjs";
import { answered, becomes, grave, OFFLINE, signIn, until, visit, wallDrawn } from "./place.mjs";

/** A call of the API as the browser's signed-in person. */
function ask(page, method, path, body) {
  return page.evaluate(async ([how, where, what]) => {
    const answer = await fetch(`/api/v1${where}`, { method: how, headers: { "content-type": "application/json" }, body: what && JSON.stringify(what) });
    return { status: answer.status, result: await answer.json().catch(() => null) };
  }, [method, path, body]);
}

/** The present code of an authenticator app (RFC 6238). */
function digits(secret) {
  const bits = [...secret].map((letter) => "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567".indexOf(letter).toString(2).padStart(5, "0")).join("");
  const key = Buffer.from(bits.match(/.{8}/g).map((byte) => parseInt(byte, 2)));
  const step = Buffer.alloc(8);
  step.writeBigUInt64BE(BigInt(Math.floor(Date.now() / 30000)));
  const hash = createHmac("sha1", key).update(step).digest();
  const number = hash.readUInt32BE(hash[19] & 15) & 0x7fffffff;
  return String(number % 1e6).padStart(6, "0");
}

test("an owner finds every member of a large gym", async ({ browser, places }) => {
  const owner = await visit(browser, places);
  const { page } = owner;
  await signIn(owner, places, places.crowd.owner);
  await owner.go(`/g/${places.crowd.gym}/settings/people`);
  await page.getByRole("combobox").nth(49).waitFor();
  // By name, though the API begins with the newest.
  assert.equal(await page.locator("li .name").first().textContent(), "climber 000");
  const search = page.getByRole("searchbox");
  for (const [text, number] of [["climber 229", 1], ["climber 00", 10], ["judge", 1]]) {
    await search.fill(text);
    await becomes(() => page.locator("li .name").count(), number);
  }
  await owner.close();
});

test("a second factor is set up, asked for, and turned off", async ({ browser, places }) => {
  const member = await visit(browser, places);
  const { page } = member;
  await signIn(member, places, places.member);
  await member.go("/me/security");
  await page.getByRole("button", { name: "Set up" }).click();
  await page.getByRole("img", { name: "QR code for the authenticator app" }).waitFor();
  const secret = await page.locator("code").first().textContent();
  assert.deepEqual(await grave(page), []);
  await member.shot("second-factor");
  await page.getByLabel("Six-digit code").fill(digits(secret)); // right before it is sent: it is good for seconds
  await page.getByRole("button", { name: "Confirm" }).click();
  await page.getByText("Save these recovery codes").waitFor();
  const recovery = await page.locator("li code").first().textContent();
  await member.go("/me");
  await page.getByRole("button", { name: "Sign out", exact: true }).click();
  await page.getByRole("link", { name: "Sign in" }).first().click();
  await page.getByLabel("Email").fill(places.member);
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Sign in", exact: true }).click();
  await page.getByLabel(/or a recovery code/).fill(recovery);
  assert.deepEqual(await grave(page), []);
  member.expected(answered(401));
  await page.getByRole("button", { name: "Sign in", exact: true }).click();
  await page.getByRole("heading", { name: "My gyms" }).waitFor();
  await member.go("/me/security");
  await page.getByText(/recovery codes left/).waitFor();
  await page.getByText("Turn off").first().click();
  await page.locator("details[open]").getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Turn off" }).click();
  await page.getByRole("button", { name: "Set up" }).waitFor();
  await member.close();
});

test("a person whom another server signed in is back on the page before", async ({ browser, places }) => {
  const visitor = await visit(browser, places);
  const { page, context } = visitor;
  await visitor.go("/me/security");
  await page.getByRole("link", { name: "Sign in" }).first().click();
  await page.getByLabel("Password").waitFor();
  const { address, member: email, password } = places;
  const signed = await context.request.post(`${address}/api/v1/session`, { data: { email, password } });
  assert.ok(signed.ok(), await signed.text());
  await visitor.go("/sign-in/done"); // the server sends browsers here that come back from the other one
  await page.waitForURL("**/me/security");
  await page.getByLabel("Name of this device").waitFor();
  await visitor.close();
});

test("a passkey is made, signs in, and goes", async ({ browser, places }) => {
  const member = await visit(browser, places);
  const { page, context } = member;
  const device = await context.newCDPSession(page);
  await device.send("WebAuthn.enable");
  const options = { protocol: "ctap2", transport: "internal", hasResidentKey: true, hasUserVerification: true, isUserVerified: true };
  await device.send("WebAuthn.addVirtualAuthenticator", { options });
  await signIn(member, places, places.member);
  await member.go("/me/security");
  await page.getByLabel("Name of this device").fill("Phone");
  await page.getByRole("button", { name: "Add a passkey" }).click();
  await page.getByText("not used yet").waitFor();
  await member.go("/me");
  await page.getByRole("button", { name: "Sign out" }).click();
  await page.getByRole("link", { name: "Sign in" }).first().click();
  await page.getByRole("button", { name: "Sign in with a passkey" }).click();
  await page.getByRole("heading", { name: "My gyms" }).waitFor();
  await member.go("/me/security");
  await page.getByText(/last used/).waitFor();
  await page.getByRole("button", { name: "Remove" }).first().click();
  await page.getByRole("dialog").getByRole("button", { name: "Remove" }).click();
  await page.getByText(/last used/).waitFor({ state: "detached" });
  // A program's token: its secret is there once.
  await page.getByText("Create token").first().click();
  await page.getByLabel("Token name").fill("Gym screen");
  await page.getByRole("button", { name: "Create token" }).click();
  assert.match(await page.getByLabel("Token secret").inputValue(), /^wtg_/);
  assert.deepEqual(await grave(page), []);
  await member.shot("security");
  await page.reload();
  await page.getByText("Gym screen").first().waitFor();
  assert.equal(await page.getByLabel("Token secret").count(), 0);
  await member.close();
});

test("a browser that somebody found asks for the password first", async ({ browser, places }) => {
  const member = await visit(browser, places);
  const { page } = member;
  await signIn(member, places, places.member);
  await member.go("/me/security");
  // The first answer is that of a sign-in of an hour ago.
  const refusal = { title: "this needs your password again", status: 403, code: "confirm-first" };
  await page.route("**/api/v1/me/tokens", (route) => route.request().method() === "POST"
    ? route.fulfill({ status: 403, contentType: "application/problem+json", body: JSON.stringify(refusal) })
    : route.fallback());
  member.expected(answered(403));
  await page.getByText("Create token").first().click();
  await page.getByLabel("Token name").fill("Borrowed");
  await page.getByRole("button", { name: "Create token" }).click();
  const dialog = page.getByRole("dialog", { name: "Confirm it’s you" });
  await dialog.waitFor();
  assert.deepEqual(await grave(page), []);
  await member.shot("confirm");
  await dialog.getByLabel("Password").fill("not the password");
  await dialog.getByRole("button", { name: "Confirm", exact: true }).click();
  await dialog.getByText(/wrong/i).waitFor();
  await page.unroute("**/api/v1/me/tokens");
  await dialog.getByLabel("Password").fill(places.password);
  await dialog.getByRole("button", { name: "Confirm", exact: true }).click();
  await dialog.waitFor({ state: "detached" });
  assert.match(await page.getByLabel("Token secret").inputValue(), /^wtg_/);
  await member.close();
});

test("another device signs in by a code that both show", async ({ browser, places }) => {
  const [laptop, phone] = [await visit(browser, places, { phone: false }), await visit(browser, places)];
  await signIn(laptop, places, places.member);
  await laptop.go("/me/security");
  const made = laptop.page.waitForResponse((answer) => answer.url().endsWith("/me/device-sign-ins"));
  await laptop.page.getByRole("button", { name: "Show code" }).click();
  const { link } = await (await made).json();
  await laptop.page.getByRole("img", { name: "QR code" }).waitFor();
  await phone.page.goto(places.address + new URL(link).pathname + new URL(link).hash);
  await phone.page.getByRole("button", { name: "Continue" }).click();
  const code = await phone.page.locator(".code").textContent();
  assert.equal(await laptop.page.locator(".code").textContent(), code);
  assert.deepEqual(await grave(laptop.page), []);
  assert.deepEqual(await grave(phone.page), []);
  await laptop.shot("device");
  await laptop.page.getByRole("button", { name: "Accept" }).click();
  await phone.page.getByRole("heading", { name: "My gyms" }).waitFor();
  await laptop.close();
  await phone.close();
});

test("without reception one's own pages show what is kept or say that they need the network", async ({ browser, places }) => {
  const member = await visit(browser, places);
  const { page, context, go } = member;
  await signIn(member, places, places.member);
  await page.evaluate(async () => {
    const { active } = await navigator.serviceWorker.ready;
    if (!navigator.serviceWorker.controller) await new Promise((resolve) => navigator.serviceWorker.addEventListener("controllerchange", resolve, { once: true }));
    return active.state;
  });
  const { result } = await ask(page, "GET", "/me");
  // Seen before: the profile. Never seen: messages, one's own page.
  await go("/me/profile");
  const reach = page.getByLabel(/Reach/);
  await reach.fill("179");
  await page.getByRole("button", { name: "Save" }).click();
  await page.getByText("Saved.").waitFor();
  await page.reload();
  await page.waitForFunction(() => [...document.querySelectorAll("input")].some(({ value }) => value === "179"));
  await context.setOffline(true);
  await go("/me/profile");
  await page.getByText("You can make changes here").waitFor();
  assert.equal(await reach.inputValue(), "179");
  assert.equal(await reach.isDisabled(), true);
  assert.equal(await page.getByRole("button", { name: "Save" }).isDisabled(), true);
  assert.deepEqual(await grave(page), []);
  await member.shot("profile-offline");
  await go("/me");
  assert.equal(await page.getByRole("button", { name: "Sign out" }).isDisabled(), true);
  await page.getByRole("link", { name: "Security" }).click();
  await page.getByText("This page needs a connection.").waitFor();
  await member.shot("security-offline");
  for (const path of ["/me/data", "/me/messages", `/people/${result.id}`, "/me/waiting", "/sign-up", "/new-password"]) {
    await go(path);
    await page.getByText(/needs a connection|Cannot reach the server|Everything is synced|Offline since/).first().waitFor();
    assert.notEqual((await page.getByRole("heading", { level: 1 }).textContent()).trim(), "", path);
  }
  // Unfinished input stays without reception, and is completed by itself later.
  await go("/me/security");
  await page.getByText("This page needs a connection.").waitFor();
  await context.setOffline(false);
  await page.getByRole("button", { name: "Set up" }).waitFor();
  await page.getByText("Create token").first().click();
  await page.getByLabel("Token name").fill("Door");
  await context.setOffline(true);
  await page.getByText("You can make changes here").waitFor();
  assert.equal(await page.getByLabel("Token name").inputValue(), "Door");
  await context.setOffline(false);
  await page.getByText("You can make changes here").waitFor({ state: "detached" });
  member.expected(OFFLINE); // the icon of the tab, which browsers look for past the service worker
  await member.close();
});

test("others see of one what one says, and no more", async ({ browser, places }) => {
  const [member, judge] = [await visit(browser, places), await visit(browser, places)];
  await signIn(member, places, places.member);
  await signIn(judge, places, places.judge);
  const { result } = await ask(member.page, "GET", "/me");
  const look = async () => {
    await judge.go(`/people/${result.id}`);
    await judge.page.getByRole("heading", { name: "Pinned" }).waitFor();
    return judge.page.getByText("Not shared with you.").count();
  };
  assert.equal(await look(), 2);
  await member.go("/me/profile");
  await member.page.getByLabel("My ascents").selectOption({ label: "Members of my gyms" });
  await member.page.getByLabel(/Reach/).fill("181");
  await member.page.getByRole("button", { name: "Save" }).click();
  await member.page.getByText("Saved.").waitFor();
  // A page that hears nothing from a busy server shows its last answer first.
  for (let tries = 0; tries < 10 && (await look()) !== 1; tries++) await judge.page.waitForTimeout(1000);
  assert.equal(await look(), 1);
  assert.equal(await judge.page.getByText("181").count(), 0);
  assert.deepEqual(await grave(judge.page), []);
  await judge.close();
  await member.close();
});

test("a wall through time, by keyboard", async ({ browser, places }) => {
  const setter = await visit(browser, places, { phone: false });
  await signIn(setter, places, places.setter);
  const { page } = setter;
  const wall = `/gyms/${places.gym}/walls/${places.wall}`;
  const { result } = await ask(page, "GET", wall);
  const body = { revision: result.revision, routes: [{ number: 1, name: "Newcomer" }] };
  assert.equal((await ask(page, "POST", `/gyms/${places.gym}/scans/${places.later}/publish`, body)).status, 200);
  await setter.go(`/g/${places.gym}/w/${places.wall}/past`);
  await page.getByText("Newcomer").waitFor();
  await wallDrawn(page);
  await page.getByRole("slider").focus();
  await page.keyboard.press("ArrowLeft");
  await page.getByText("Moon 1").waitFor();
  assert.match(page.url(), new RegExp(`/past/${places.scan}$`));
  await wallDrawn(page);
  assert.deepEqual(await grave(page), []);
  await setter.shot("past");
  await setter.close();
});

test("a gym gone private while it is open says so", async ({ browser, places }) => {
  const [guest, owner] = [await visit(browser, places), await visit(browser, places)];
  await guest.go(`/g/${places.gym}`);
  await guest.page.getByRole("link", { name: "Cave" }).first().waitFor();
  await signIn(owner, places, places.owner);
  const put = (visibility) => ask(owner.page, "PATCH", `/gyms/${places.gym}`, { visibility });
  assert.equal((await put("private")).status, 200);
  await guest.page.getByRole("link", { name: "Cave" }).first().click();
  await guest.page.getByText("no such gym").first().waitFor();
  await guest.page.getByRole("main").getByRole("link", { name: "Sign in" }).first().waitFor();
  assert.equal((await put("public")).status, 200);
  guest.expected(answered(404));
  await guest.close();
  await owner.close();
});

test("signing out removes what private gyms left in the browser", async ({ browser, places }) => {
  const [member, owner] = [await visit(browser, places), await visit(browser, places)];
  const { page } = member;
  await signIn(owner, places, places.owner);
  await signIn(member, places, places.member);
  const kept = () => page.evaluate(async () => {
    const files = await caches.open("files");
    const rows = await Promise.all((await files.keys()).map(async (key) => (await files.match(key)).headers.get("cache-control")));
    return { private: rows.filter((row) => /private/.test(row)).length, public: rows.filter((row) => /public/.test(row)).length };
  });
  const look = async (visibility) => {
    assert.equal((await ask(owner.page, "PATCH", `/gyms/${places.gym}`, { visibility })).status, 200);
    await page.evaluate(() => caches.delete("files"));
    await member.go(`/g/${places.gym}`);
    await page.getByRole("link", { name: "Cave" }).first().click();
    await wallDrawn(page);
  };
  const signOut = async () => {
    await member.go("/me");
    await page.getByRole("button", { name: "Sign out", exact: true }).click();
    await page.getByRole("link", { name: "Sign in" }).first().waitFor();
  };
  await look("private");
  await until(async () => (await kept()).private > 0); // the service worker stores them after the page has them
  await signOut();
  await page.waitForFunction(async () => (await (await caches.open("files")).keys()).length === 0);
  await signIn(member, places, places.member);
  await look("public");
  await until(async () => (await kept()).public > 0);
  const before = await kept();
  await signOut();
  assert.deepEqual(await kept(), before); // a visitor may see them, also offline
  await member.close();
  await owner.close();
});

test("who is excluded is told so, takes their data, and goes", async ({ browser, places }) => {
  const [judge, owner] = [await visit(browser, places), await visit(browser, places)];
  await signIn(judge, places, places.judge);
  await signIn(owner, places, places.owner);
  await owner.go(`/g/${places.gym}/settings/people`);
  const line = owner.page.getByRole("listitem").filter({ hasText: "judge" }).first();
  await line.getByRole("button", { name: "Ban" }).click();
  await owner.page.getByRole("dialog", { name: "Ban" }).getByRole("button", { name: "Ban" }).click();
  await owner.page.getByRole("button", { name: "Lift ban" }).waitFor();
  await judge.go(`/g/${places.gym}`);
  await judge.page.getByRole("button", { name: "Join this gym" }).click();
  await judge.page.getByText("this gym has banned you").waitFor();
  judge.expected(answered(403));
  await judge.go("/me/data");
  const saved = judge.page.waitForEvent("download");
  await judge.page.getByRole("link", { name: "Everything (JSON)" }).click();
  assert.equal((await saved).suggestedFilename(), "walltopo.json");
  await judge.page.getByLabel("Password").fill(places.password);
  await judge.page.getByLabel("I have downloaded the data I want to keep.").check();
  await judge.page.getByRole("button", { name: "Delete permanently" }).click();
  await judge.page.getByRole("link", { name: "Sign in" }).first().waitFor();
  await judge.close();
  await owner.close();
});
