// The plain pages: readable for everybody, in each language, at twice the text size.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { answered, grave, signIn, tooWide, visit } from "./place.mjs";

test("nothing grave on the plain pages, light and dark", async ({ browser, places }) => {
  for (const dark of [false, true]) {
    const setter = await visit(browser, places, { dark });
    await setter.go("/sign-in");
    assert.deepEqual(await grave(setter.page), []);
    await signIn(setter, places, places.owner);
    const pages = ["/", "/sign-up", "/new-password", "/new-gym", "/me", "/me/profile", "/me/security", "/me/data", "/sign-in/device", "/selftest", "/no-such-page",
      `/g/${places.gym}/settings`, `/g/${places.gym}/w/${places.wall}/versions`];
    for (const path of pages) {
      await setter.go(path);
      await setter.page.waitForFunction(() => !document.querySelector("main [role=status].quiet"));
      assert.deepEqual(await grave(setter.page), [], path);
    }
    setter.expected(answered(404));
    await setter.close();
  }
});

test("speaks the reader's language, and another when asked", async ({ browser, places }) => {
  for (const [locale, words] of [["de-AT", "Anmelden"], ["cs-CZ", "Přihlásit se"], ["fr-FR", "Se connecter"], ["ja-JP", "Sign in"]]) {
    const guest = await visit(browser, places, { locale });
    await guest.go("/sign-in");
    await guest.page.getByRole("heading", { name: words }).waitFor();
    await guest.page.locator("footer select").first().selectOption("cs");
    await guest.page.getByRole("heading", { name: "Přihlásit se" }).waitFor();
    assert.equal(await guest.page.getAttribute("html", "lang"), "cs");
    await guest.close();
  }
});

test("fits at twice the text size", async ({ browser, places }) => {
  const owner = await visit(browser, places);
  await signIn(owner, places, places.owner);
  for (const path of ["/", "/me", "/me/profile", "/me/security", "/me/data", `/g/${places.gym}`, `/g/${places.gym}/settings`]) {
    await owner.go(path);
    await owner.page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
    await owner.page.waitForFunction(() => !document.querySelector("main [role=status].quiet"));
    const wide = await tooWide(owner.page);
    assert.ok(wide <= 0, `${path} is ${wide} pixels too wide`);
  }
  await owner.shot("twice");
  await owner.close();
});

test("signs out everywhere", async ({ browser, places }) => {
  const [one, other] = [await visit(browser, places), await visit(browser, places)];
  await signIn(one, places, places.member, { own: true });
  await signIn(other, places, places.member, { own: true });
  const me = await other.page.evaluate(() => fetch("/api/v1/me", { cache: "no-store" }).then((response) => response.text()));
  await one.go("/me/security");
  await one.page.getByRole("button", { name: "Sign out everywhere" }).click();
  await one.page.getByRole("dialog").getByRole("button", { name: "Sign out everywhere" }).click();
  await one.page.getByRole("heading", { name: "Sign in" }).waitFor();
  // The other browser hears it from the first answer, even if the one to who it is comes from before.
  await other.context.addInitScript((before) => {
    const real = window.fetch;
    let isFirst = true;
    window.fetch = (input, init) => {
      const isAsked = isFirst && String(input.url ?? input).endsWith("/api/v1/me");
      if (isAsked && input.cache !== "only-if-cached") isFirst = false;
      return isAsked ? Promise.resolve(new Response(before, { headers: { "content-type": "application/json" } })) : real(input, init);
    };
  }, me);
  await other.page.reload();
  await other.page.getByRole("link", { name: "Sign in" }).waitFor();
  other.expected(answered(401));
  await one.close();
  await other.close();
});

test("a gym does without what its owner switched off", async ({ browser, places }) => {
  const owner = await visit(browser, places);
  await signIn(owner, places, places.owner);
  const { page } = owner;
  const settings = `/g/${places.gym}/settings`;
  const turn = async (on) => {
    await owner.go(settings);
    for (const name of ["Competitions", "Screen and print", "Insights"]) await page.getByRole("checkbox", { name }).setChecked(on);
    await page.getByRole("button", { name: "Save", exact: true }).click();
    await page.getByText("Saved").waitFor();
  };
  const entries = async () => {
    await owner.go(settings);
    await page.getByRole("link", { name: "Zones and plans" }).waitFor();
    const there = [await page.getByRole("link", { name: "Insights" }).count(), await page.getByRole("link", { name: "Screen and print" }).count()];
    await owner.go(`/g/${places.gym}`);
    await page.getByRole("link", { name: "Settings" }).waitFor();
    return [...there, await page.getByRole("link", { name: "Competitions" }).count()];
  };
  assert.deepEqual(await entries(), [1, 1, 1]);
  await turn(false);
  assert.deepEqual(await grave(page), []);
  await owner.shot("settings-optional");
  assert.deepEqual(await entries(), [0, 0, 0]);
  for (const path of ["competitions", "settings/hall", "settings/hall/paper", "insights", "insights/holds"]) {
    await owner.go(`/g/${places.gym}/${path}`);
    await page.getByRole("heading", { name: "Page not found" }).waitFor();
    await page.waitForLoadState("networkidle"); // an answer 404 may reach the console after the heading
  }
  owner.expected(answered(404));
  await turn(true);
  assert.deepEqual(await entries(), [1, 1, 1]);
  await owner.close();
});

test("tells what the browser can do, and nothing else", async ({ browser, places }) => {
  const guest = await visit(browser, places);
  await guest.go("/selftest");
  await guest.page.getByText("Done.").waitFor();
  await guest.shot("selftest");
  const text = decodeURIComponent(await guest.page.getByRole("link", { name: "Mail result" }).getAttribute("href"));
  for (const check of ["graphics: ok (WebGL 2", "storage: ok", "network: ok", "clock: ok"]) assert.ok(text.includes(check), text);
  for (const secret of [places.gym, places.wall]) assert.ok(!text.includes(secret), text);
  await guest.close();
});

test("a page whose script is not loaded says so, and comes when asked again", async ({ browser, places }) => {
  const guest = await visit(browser, places, { worker: false }); // which has all scripts
  const { page } = guest;
  const notLoaded = page.getByRole("heading", { name: "This page was not loaded" });
  guest.expected(/net::ERR_FAILED/, /dynamically imported module/);
  await guest.go("/");
  await page.getByRole("link", { name: "Sign in" }).first().click();
  await page.getByRole("heading", { name: "Sign in" }).waitFor();
  await guest.context.route("**/assets/SelfTest-*.js", (request) => request.abort());
  await page.getByRole("link", { name: "Test this device" }).click();
  await notLoaded.waitFor();
  await guest.shot("not-loaded");
  assert.deepEqual(await grave(page), []);
  await page.goBack();
  await page.getByRole("heading", { name: "Climbing walls in 3D" }).waitFor();
  await page.getByRole("link", { name: "Test this device" }).click();
  await notLoaded.waitFor();
  await guest.context.unroute("**/assets/SelfTest-*.js");
  await page.getByRole("button", { name: "Try again" }).click();
  await page.getByText("Done.").waitFor();
  await guest.close();
});
