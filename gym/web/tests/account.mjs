// One's account: ways in, what others see, and what is left of it; a wall through time; a gym gone private.

import assert from "node:assert/strict";
import { createHmac } from "node:crypto";
import { grave, signIn, visit, wallDrawn } from "./place.mjs";

/** A call of the API as whoever is signed in there. */
function ask(page, method, path, body) {
  return page.evaluate(async ([how, where, what]) => {
    const answer = await fetch(`/api/v1${where}`, { method: how, headers: { "content-type": "application/json" }, body: what && JSON.stringify(what) });
    return { status: answer.status, told: await answer.json().catch(() => null) };
  }, [method, path, body]);
}

/** What an authenticator app shows now (RFC 6238, six digits of half a minute). */
function digits(secret) {
  const bits = [...secret].map((letter) => "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567".indexOf(letter).toString(2).padStart(5, "0")).join("");
  const key = Buffer.from(bits.match(/.{8}/g).map((byte) => parseInt(byte, 2)));
  const step = Buffer.alloc(8);
  step.writeBigUInt64BE(BigInt(Math.floor(Date.now() / 30000)));
  const hash = createHmac("sha1", key).update(step).digest();
  const number = hash.readUInt32BE(hash[19] & 15) & 0x7fffffff;
  return String(number % 1e6).padStart(6, "0");
}

export const account = {
  async "a second factor is set up, asked for, and turned off"(browser, places) {
    const member = await visit(browser, places);
    const { page } = member;
    await signIn(member, places, places.member);
    await member.go("/me/security");
    await page.getByRole("button", { name: "Set it up" }).click();
    await page.getByRole("img", { name: "QR code for the authenticator app" }).waitFor();
    const secret = await page.locator("code").first().textContent();
    await page.getByLabel("Digits from the app").fill(digits(secret));
    assert.deepEqual(await grave(page), []);
    await member.shot("second-factor");
    await page.getByRole("button", { name: "Confirm" }).click();
    await page.getByText("Keep these recovery codes").waitFor();
    const recovery = await page.locator("li code").first().textContent();
    await member.go("/me");
    await page.getByRole("button", { name: "Sign out", exact: true }).click();
    await page.getByRole("link", { name: "Sign in" }).first().click();
    await page.getByLabel("E-mail").fill(places.member);
    await page.getByLabel("Password").fill(places.password);
    await page.getByRole("button", { name: "Sign in", exact: true }).click();
    await page.getByLabel(/or a recovery code/).fill(recovery);
    assert.deepEqual(await grave(page), []);
    member.log.length = 0; // the answer 401
    await page.getByRole("button", { name: "Sign in", exact: true }).click();
    await page.getByRole("heading", { name: "My gyms" }).waitFor();
    await member.go("/me/security");
    await page.getByText(/recovery codes are left/).waitFor();
    await page.getByText("Turn it off").first().click();
    await page.locator("details[open]").getByLabel("Password").fill(places.password);
    await page.getByRole("button", { name: "Turn it off" }).click();
    await page.getByRole("button", { name: "Set it up" }).waitFor();
    await member.close();
  },

  async "a passkey is made, signs in, and goes"(browser, places) {
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
    await page.getByText("Make a token").first().click();
    await page.getByLabel("What for").fill("Screen in the hall");
    await page.getByRole("button", { name: "Make a token" }).click();
    assert.match(await page.getByLabel("Secret of the token").inputValue(), /^wtg_/);
    assert.deepEqual(await grave(page), []);
    await member.shot("security");
    await page.reload();
    await page.getByText("Screen in the hall").first().waitFor();
    assert.equal(await page.getByLabel("Secret of the token").count(), 0);
    await member.close();
  },

  async "another device signs in by a code that both show"(browser, places) {
    const [laptop, phone] = [await visit(browser, places, { phone: false }), await visit(browser, places)];
    await signIn(laptop, places, places.member);
    await laptop.go("/me/security");
    const made = laptop.page.waitForResponse((answer) => answer.url().endsWith("/me/handovers"));
    await laptop.page.getByRole("button", { name: "Show the code" }).click();
    const { link } = await (await made).json();
    await laptop.page.getByRole("img", { name: "QR code" }).waitFor();
    await phone.page.goto(places.address + new URL(link).pathname + new URL(link).hash);
    await phone.page.getByRole("button", { name: "Go on" }).click();
    const code = await phone.page.locator(".code").textContent();
    assert.equal(await laptop.page.locator(".code").textContent(), code);
    assert.deepEqual(await grave(laptop.page), []);
    assert.deepEqual(await grave(phone.page), []);
    await laptop.shot("device");
    await laptop.page.getByRole("button", { name: "Yes, let it in" }).click();
    await phone.page.getByRole("heading", { name: "My gyms" }).waitFor();
    await laptop.close();
    await phone.close();
  },

  async "without reception one's own pages show what is kept or say that they need the network"(browser, places) {
    const member = await visit(browser, places);
    const { page, context, go } = member;
    await signIn(member, places, places.member);
    await page.evaluate(async () => {
      const { active } = await navigator.serviceWorker.ready;
      if (!navigator.serviceWorker.controller) await new Promise((resolve) => navigator.serviceWorker.addEventListener("controllerchange", resolve, { once: true }));
      return active.state;
    });
    const { told } = await ask(page, "GET", "/me");
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
    await page.getByText("nothing can be changed here").waitFor();
    assert.equal(await reach.inputValue(), "179");
    assert.equal(await reach.isDisabled(), true);
    assert.equal(await page.getByRole("button", { name: "Save" }).isDisabled(), true);
    assert.deepEqual(await grave(page), []);
    await member.shot("profile-offline");
    await go("/me");
    assert.equal(await page.getByRole("button", { name: "Sign out" }).isDisabled(), true);
    await page.getByRole("link", { name: "Security" }).click();
    await page.getByText("This page needs the network.").waitFor();
    await member.shot("security-offline");
    for (const path of ["/me/data", "/me/messages", `/people/${told.id}`, "/me/waiting", "/sign-up", "/new-password"]) {
      await go(path);
      await page.getByText(/needs the network|cannot be reached|Everything has arrived|Offline\./).first().waitFor();
      assert.notEqual((await page.getByRole("heading", { level: 1 }).textContent()).trim(), "", path);
    }
    // What was begun stays when reception goes, and what waited for it comes by itself.
    await go("/me/security");
    await page.getByText("This page needs the network.").waitFor();
    await context.setOffline(false);
    await page.getByRole("button", { name: "Set it up" }).waitFor();
    await page.getByText("Make a token").first().click();
    await page.getByLabel("What for").fill("Door");
    await context.setOffline(true);
    await page.getByText("nothing can be changed here").waitFor();
    assert.equal(await page.getByLabel("What for").inputValue(), "Door");
    await context.setOffline(false);
    await page.getByText("nothing can be changed here").waitFor({ state: "detached" });
    member.log.length = 0; // the icon of the tab, which browsers look for past the service worker
    await member.close();
  },

  async "others see of one what one says, and no more"(browser, places) {
    const [member, judge] = [await visit(browser, places), await visit(browser, places)];
    await signIn(member, places, places.member);
    await signIn(judge, places, places.judge);
    const { told } = await ask(member.page, "GET", "/me");
    const look = async () => {
      await judge.go(`/people/${told.id}`);
      await judge.page.getByRole("heading", { name: "Pinned" }).waitFor();
      return judge.page.getByText("Not shown to you.").count();
    };
    assert.equal(await look(), 2);
    await member.go("/me/profile");
    await member.page.getByLabel("What I climb").selectOption({ label: "Members of my gyms" });
    await member.page.getByLabel(/Reach/).fill("181");
    await member.page.getByRole("button", { name: "Save" }).click();
    await member.page.getByText("Saved.").waitFor();
    assert.equal(await look(), 1);
    assert.equal(await judge.page.getByText("181").count(), 0);
    assert.deepEqual(await grave(judge.page), []);
    await judge.close();
    await member.close();
  },

  async "a wall through time, by keyboard"(browser, places) {
    const setter = await visit(browser, places, { phone: false });
    await signIn(setter, places, places.setter);
    const { page } = setter;
    const wall = `/gyms/${places.gym}/walls/${places.wall}`;
    const { told } = await ask(page, "GET", wall);
    const body = { revision: told.revision, routes: [{ number: 1, name: "Newcomer" }] };
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
  },

  async "a gym gone private while it is open says so"(browser, places) {
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
    guest.log.length = 0; // the answers 404, which it is about
    await guest.close();
    await owner.close();
  },

  async "who is excluded is told so, takes their data, and goes"(browser, places) {
    const [judge, owner] = [await visit(browser, places), await visit(browser, places)];
    await signIn(judge, places, places.judge);
    await signIn(owner, places, places.owner);
    await owner.go(`/g/${places.gym}/settings/people`);
    const line = owner.page.getByRole("listitem").filter({ hasText: "judge" }).first();
    await line.getByRole("button", { name: "Exclude" }).click();
    await owner.page.getByRole("dialog", { name: "Exclude" }).getByRole("button", { name: "Exclude" }).click();
    await owner.page.getByRole("button", { name: "Let them join again" }).waitFor();
    await judge.go(`/g/${places.gym}`);
    await judge.page.getByRole("button", { name: "Join this gym" }).click();
    await judge.page.getByText("this gym has excluded you").waitFor();
    judge.log.length = 0; // the answer 403
    await judge.go("/me/data");
    const saved = judge.page.waitForEvent("download");
    await judge.page.getByRole("link", { name: "Everything (JSON)" }).click();
    assert.equal((await saved).suggestedFilename(), "walltopo.json");
    await judge.page.getByLabel("Password").fill(places.password);
    await judge.page.getByLabel("I have what I want to keep.").check();
    await judge.page.getByRole("button", { name: "Delete for good" }).click();
    await judge.page.getByRole("link", { name: "Sign in" }).first().waitFor();
    await judge.close();
    await owner.close();
  },
};
