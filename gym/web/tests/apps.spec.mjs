// Apps of others: one is registered, connected in another browser, reads a logbook, and is disconnected.

import assert from "node:assert/strict";
import { createHash, randomBytes } from "node:crypto";
import { createServer } from "node:http";
import { test } from "./fixtures.mjs";
import { answered, grave, signIn, tooWide, visit } from "./place.mjs";

const SMALL = { viewport: { width: 360, height: 740 } };
const NAME = "Log for climbers";

/** A program on the person's own device: it listens on a free port for the answer to its link (RFC 8252). */
async function client(places, id) {
  const came = [];
  const server = createServer((request, response) => {
    const url = new URL(request.url, "http://127.0.0.1");
    if (url.pathname === "/done") came.push(Object.fromEntries(url.searchParams));
    response.setHeader("content-type", "text/html");
    response.end("<!doctype html><html lang=en><link rel=icon href=data:,><title>Log</title><h1>Back in the app</h1>");
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const redirect_uri = `http://127.0.0.1:${server.address().port}/done`;
  const verifier = randomBytes(32).toString("base64url");
  const challenge = createHash("sha256").update(verifier).digest("base64url");
  const link = `/oauth/authorize?${new URLSearchParams({
    response_type: "code", client_id: id, redirect_uri, scope: "read", state: "climb 7", code_challenge: challenge, code_challenge_method: "S256",
  })}`;
  const tokens = async (fields) => {
    const body = new URLSearchParams({ client_id: id, ...fields });
    const answer = await fetch(`${places.address}/oauth/token`, { method: "POST", body });
    return { status: answer.status, ...(await answer.json()) };
  };
  return {
    link, came, redirect_uri, refresh: (refresh_token) => tokens({ grant_type: "refresh_token", refresh_token }),
    redeem: (code) => tokens({ grant_type: "authorization_code", code, redirect_uri, code_verifier: verifier }),
    close: () => new Promise((resolve) => server.close(resolve)),
  };
}

/** The status of the person's logbook for a page of another origin, with a token and no cookie. */
const logbook = (page, places, token) => page.evaluate(async ([address, gym, secret]) => {
  const answer = await fetch(`${address}/api/v1/gyms/${gym}/logbook`, { headers: { authorization: `Bearer ${secret}` } });
  return answer.status;
}, [places.address, places.gym, token]);

async function looksRight(person, name) {
  assert.deepEqual(await grave(person.page), []);
  assert.ok((await tooWide(person.page)) <= 0, `${name} is too wide`);
  await person.shot(name);
}

/** Register an app as its developer; returns its client id. */
async function register(browser, places) {
  const developer = await visit(browser, places, SMALL);
  const { page } = developer;
  await signIn(developer, places, places.judge);
  await developer.go("/me");
  await page.getByRole("link", { name: "Connected apps" }).click();
  await page.getByText("No app is connected.").waitFor();
  await page.getByText("Register app").first().click();
  await page.getByLabel("App name").fill(NAME);
  await page.getByLabel("Home page").fill("https://log.example/");
  const redirects = page.getByLabel("Redirect addresses, one per line");
  await redirects.fill("http://log.example/done");
  developer.expected(answered(422));
  await page.getByRole("button", { name: "Register app" }).click();
  await page.getByText(/cannot be a redirect address/).waitFor();
  await redirects.fill("http://127.0.0.1/done\ncom.example.log:/done");
  await page.getByRole("button", { name: "Register app" }).click();
  const id = await page.getByText("Client ID").locator("code").textContent();
  assert.equal(await page.getByLabel("Client secret").count(), 0); // a public client has none
  await looksRight(developer, "apps-own");
  await developer.close();
  return id;
}

test("an app is registered, connected, reads, and is disconnected", async ({ browser, places }) => {
  const app = await client(places, await register(browser, places));
  const member = await visit(browser, places, SMALL);
  const { page } = member;
  member.expected(/^request to http:\/\/127\.0\.0\.1/, answered(401));
  // Nobody is signed in yet: the question waits until after the sign-in.
  await member.go(app.link);
  await page.getByText("An app wants to act for you.", { exact: false }).waitFor();
  await page.locator("main").getByRole("link", { name: "Sign in" }).click();
  await page.getByLabel("Email").fill(places.member);
  await page.getByLabel("Password").fill(places.password);
  await page.getByRole("button", { name: "Sign in", exact: true }).click();
  await page.getByText(`${NAME} wants to act for you.`).waitFor();
  await page.getByText("read everything you can read").waitFor();
  await page.getByText("Registered here by judge.", { exact: false }).waitFor();
  await looksRight(member, "apps-consent");
  await page.getByRole("button", { name: "Decline" }).click();
  await page.getByRole("heading", { name: "Back in the app" }).waitFor();
  assert.equal(app.came.at(-1).error, "access_denied");
  // A link that leads elsewhere gets no answer but on the page.
  member.expected(answered(422));
  await member.go(app.link.replace("127.0.0.1", "evil.example"));
  await page.getByText("this link leads to an address that its app has not registered", { exact: false }).waitFor();
  assert.equal(await page.getByRole("button", { name: "Allow" }).count(), 0);
  await looksRight(member, "apps-refused");
  await member.go(app.link);
  await page.getByRole("button", { name: "Allow" }).click();
  await page.getByRole("heading", { name: "Back in the app" }).waitFor();
  const { code, state, iss } = app.came.at(-1);
  assert.deepEqual([state, iss], ["climb 7", places.address]);
  const first = await app.redeem(code);
  assert.equal(first.status, 200);
  assert.equal(await logbook(page, places, first.access_token), 200);
  const second = await app.refresh(first.refresh_token);
  assert.equal(await logbook(page, places, second.access_token), 200);
  // A consent that adds nothing says so.
  await member.go(app.link);
  await page.getByText("(allowed already)").waitFor();
  await member.go("/me/apps");
  await page.getByText(/last active/).waitFor();
  await looksRight(member, "apps-connected");
  await page.getByRole("button", { name: "Disconnect" }).click();
  await page.getByRole("dialog").getByRole("button", { name: "Disconnect" }).click();
  await page.getByText("No app is connected.").waitFor();
  await page.goto(app.redirect_uri);
  assert.equal(await logbook(page, places, second.access_token), 401);
  assert.equal((await app.refresh(second.refresh_token)).error, "invalid_grant");
  await member.close();
  await app.close();
});
