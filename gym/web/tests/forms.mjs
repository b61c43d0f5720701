// The plain pages: readable for everybody, in each language, at twice the text size.

import assert from "node:assert/strict";
import { grave, signIn, tooWide, visit } from "./place.mjs";

export const forms = {
  async "nothing grave on the plain pages, light and dark"(browser, places) {
    for (const dark of [false, true]) {
      const setter = await visit(browser, places, { dark });
      await setter.go("/sign-in");
      assert.deepEqual(await grave(setter.page), []);
      await signIn(setter, places, places.owner);
      const pages = ["/", "/sign-up", "/new-password", "/new-gym", "/me", "/me/profile", "/me/security", "/me/data", "/sign-in/device", "/no-such-page",
        `/g/${places.gym}/settings`, `/g/${places.gym}/w/${places.wall}/versions`];
      for (const path of pages) {
        await setter.go(path);
        await setter.page.waitForFunction(() => !document.querySelector("main [role=status].quiet"));
        assert.deepEqual(await grave(setter.page), [], path);
      }
      setter.log.splice(0, setter.log.length, ...setter.log.filter((line) => !line.includes("404")));
      await setter.close();
    }
  },

  async "speaks the reader's language, and another when asked"(browser, places) {
    for (const [locale, words] of [["de-AT", "Anmelden"], ["cs-CZ", "Přihlásit se"], ["fr-FR", "Se connecter"], ["ja-JP", "Sign in"]]) {
      const guest = await visit(browser, places, { locale });
      await guest.go("/sign-in");
      await guest.page.getByRole("heading", { name: words }).waitFor();
      await guest.page.locator("footer select").selectOption("cs");
      await guest.page.getByRole("heading", { name: "Přihlásit se" }).waitFor();
      assert.equal(await guest.page.getAttribute("html", "lang"), "cs");
      await guest.close();
    }
  },

  async "fits at twice the text size"(browser, places) {
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
  },

  async "signs out everywhere"(browser, places) {
    const [one, other] = [await visit(browser, places), await visit(browser, places)];
    await signIn(one, places, places.member);
    await signIn(other, places, places.member);
    await one.go("/me/security");
    await one.page.getByRole("button", { name: "Sign out everywhere" }).click();
    await one.page.getByRole("dialog").getByRole("button", { name: "Sign out everywhere" }).click();
    await one.page.getByRole("heading", { name: "Sign in" }).waitFor();
    await other.page.reload();
    await other.page.getByRole("link", { name: "Sign in" }).waitFor();
    other.log.length = 0; // the answer 401, which it is about
    await one.close();
    await other.close();
  },
};
