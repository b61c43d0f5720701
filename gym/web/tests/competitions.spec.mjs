// A competition from the wizard to the board: made by a setter, entered by a climber, judged without reception, seen live.

import assert from "node:assert/strict";
import { test } from "./fixtures.mjs";
import { becomes, grave, OFFLINE, signIn, tooWide, visit } from "./place.mjs";

const NAMES = ["Anna Svobodová", "Béla Tóth", "Chloé Roux"];
const LIST = (category) => ["name;category;gender;bib;club", ...NAMES.map((name, at) => `${name};${category};women;${at + 11};Prague`)].join("\n");

/** The server's data, as the browser's person may see it. */
function result(page, path) {
  return page.evaluate((address) => fetch(`/api/v1${address}`, { cache: "no-store" }).then((answer) => answer.json()), path);
}

async function fine(somebody, name) {
  const { page } = somebody;
  assert.deepEqual(await grave(page), [], name);
  await page.evaluate(() => document.documentElement.style.setProperty("font-size", "200%"));
  const wide = await tooWide(page);
  await page.evaluate(() => document.documentElement.style.removeProperty("font-size"));
  assert.ok(wide <= 0, `${name} is ${wide} pixels too wide`);
  await somebody.shot(`competition-${name}`);
}

/** The wizard's steps, from the list of competitions to the new one's page; its address. */
async function made(setter, places) {
  const { page } = setter;
  await setter.go(`/g/${places.gym}`);
  await page.getByRole("link", { name: "Competitions" }).click();
  await page.getByText("No competitions yet.").waitFor();
  await page.getByRole("link", { name: "New competition" }).click();
  const on = () => page.getByRole("button", { name: "Continue" }).click();
  await page.getByLabel("Competition name").fill("Winter Jam");
  await fine(setter, "wizard-what");
  await on();
  await page.getByRole("button", { name: /^All \(/ }).click();
  await page.getByLabel("Problems not on the wall yet").fill("2");
  await fine(setter, "wizard-problems");
  await on();
  await page.getByLabel("Category name").first().waitFor();
  await fine(setter, "wizard-categories");
  await on();
  await page.getByText("Flash 120 points").waitFor();
  await page.getByText("Single problems: labels and points").click();
  const first = page.locator("details fieldset").first();
  await first.getByLabel("Label").fill("A1");
  await first.getByLabel("Own points").check();
  await first.getByLabel("Flash").fill("300");
  await fine(setter, "wizard-points");
  await on();
  await page.getByRole("textbox", { name: "Fee" }).fill("100 CZK at the desk");
  await page.getByLabel("Waiver that").fill("I climb at my own risk.");
  await fine(setter, "wizard-entry");
  await on();
  await page.getByText("All problems count.").waitFor();
  await page.getByText("One problem has its own points.").waitFor();
  await page.getByText("Fee: 100 CZK at the desk").waitFor();
  await fine(setter, "wizard-summary");
  await page.getByRole("button", { name: "Create competition" }).click();
  await page.getByRole("heading", { name: "Winter Jam" }).waitFor();
  return new URL(page.url()).pathname;
}

/** A list with an error imports nobody; without it, everybody. */
async function listed(setter) {
  const { page } = setter;
  await page.getByRole("link", { name: "Start list" }).click();
  await page.getByText("Import list (CSV)").click();
  await page.getByLabel("Or paste it here").fill(LIST("Wimmen"));
  await page.getByRole("button", { name: "Import" }).click();
  await page.getByText("Line 2").waitFor();
  await page.getByText("Categories: Women, Men.").first().waitFor();
  await fine(setter, "list-wrong");
  await page.getByLabel("Or paste it here").fill(LIST("Women"));
  await page.getByRole("button", { name: "Import" }).click();
  await page.getByText("3 competitors were added.").waitFor();
  await page.getByText("Béla Tóth Women").waitFor();
  await fine(setter, "list");
  // The same name again: the list says whom it means, and the setter can add another person.
  await page.getByLabel("Or paste it here").fill("name;category;gender\nBéla Tóth;Women;w");
  await page.getByRole("button", { name: "Import" }).click();
  await page.getByText("One competitor is on the list already.").waitFor();
  const add = page.getByRole("button", { name: "Add as other people" });
  assert.ok(await add.isDisabled());
  await page.getByLabel(/Line 2: Béla Tóth.*No. 12/).check();
  assert.ok(await add.isEnabled());
  await fine(setter, "list-namesake");
}

async function entered(climber, place) {
  const { page } = climber;
  await climber.go(place);
  await page.getByRole("radio", { name: "Men", exact: true }).check();
  const enter = page.getByRole("button", { name: "Enter", exact: true });
  assert.equal(await enter.isDisabled(), true); // the waiver first
  await page.getByLabel("I have read and accept the waiver.").check();
  await fine(climber, "entry");
  await enter.click();
  await page.getByText("You are entered.").waitFor();
}

/** Five events without reception, one of them withdrawn; then each of them once at the server. */
async function judged(judge, places, place) {
  const { page, context, expected } = judge;
  await judge.go(place);
  await page.getByRole("link", { name: "Judging" }).click();
  await page.locator("[data-kept=yes]").waitFor();
  await fine(judge, "judge");
  await context.setOffline(true);
  await page.getByRole("main").locator("li a").first().click();
  const pad = (name) => page.getByRole("group", { name: new RegExp(name) });
  await page.getByRole("button", { name: /11 Anna/ }).last().click();
  await pad("Anna").getByRole("button", { name: /^Try/ }).click();
  await pad("Anna").getByRole("button", { name: /^Zone/ }).click();
  // In the same try as the zone.
  await pad("Anna").getByRole("button", { name: "Top try 2" }).click();
  await page.getByText("Top, try 2: saved.").waitFor();
  await page.getByRole("button", { name: "Next: 12 Béla" }).click();
  await pad("Béla").getByRole("button", { name: "Top try 1" }).click();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByText("Undone.").waitFor();
  await pad("Béla").getByRole("button", { name: /^Try/ }).click();
  await page.getByLabel("Bib or name").fill("chloe");
  await page.getByRole("button", { name: /13 Chloé/ }).last().click();
  await pad("Chloé").getByRole("button", { name: "Top try 1" }).click();
  await page.getByRole("link", { name: "5 entries waiting to sync" }).waitFor();
  await fine(judge, "judge-offline");
  await context.setOffline(false);
  await page.evaluate(() => dispatchEvent(new Event("online")));
  await page.getByText("Everything is synced.").waitFor();
  expected(OFFLINE);
  const { items } = await result(page, `${place.replace(/^\/g/, "/gyms")}/events?size=100`);
  assert.deepEqual(items.map(({ kind, n }) => `${kind} ${n}`).sort(), ["attempt 1", "attempt 1", "top 1", "top 2", "zone 2"]);
  await page.getByText("History (").click();
  await fine(judge, "judge-history");
}

/** Disqualified, with the reason visible to everybody; and reinstated. */
async function disqualified(judge, guest, place) {
  const { page } = judge;
  await judge.go(`${place}/entries`);
  const row = page.locator("[data-bib='12']");
  await row.locator("summary").click();
  await row.getByLabel("Reason").fill("Left the mat during the try.");
  await fine(judge, "disqualify");
  await row.getByRole("button", { name: "Disqualify" }).click();
  await row.getByText("not ranked").waitFor();
  await page.getByText("Everything is synced.").waitFor();
  await page.getByRole("button", { name: "Show only these (1)" }).click();
  assert.equal(await page.locator("[data-bib]").count(), 1);
  await fine(judge, "disqualified");
  await guest.page.getByRole("row", { name: /Béla/ }).getByText("not ranked").waitFor();
  await row.getByRole("button", { name: "Reinstate" }).click();
  await row.getByText("not ranked").waitFor({ state: "detached" });
  await guest.page.getByRole("row", { name: /^3 Béla/ }).waitFor();
}

/** A request about competitions of the gym, by the browser's person. */
function request(page, gym, method, path, body) {
  return page.evaluate(async ([of, how, where, what]) => {
    const headers = { "content-type": "application/json" };
    const answer = await fetch(`/api/v1/gyms/${of}/competitions${where}`, { method: how, headers, body: JSON.stringify(what) });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.status === 204 ? null : answer.json();
  }, [gym, method, path, body]);
}

/** A competition over the API: its requests, competitors and score events. */
function over(page, gym, id) {
  const ask = (method, path, body) => request(page, gym, method, `/${id}${path}`, body);
  let number = 0;
  return {
    ask,
    entry: async (name, category_id) => (await ask("POST", "/entries", { name, category_id, gender: "women" })).id,
    event: (words) => {
      const now = new Date().toISOString();
      return ask("PUT", `/events/${crypto.randomUUID()}`, { device: "check", number: (number += 1), made_at: now, sent_at: now, ...words });
    },
  };
}

/** Make a cup whose qualification is over, without the app; return its address. */
async function qualified(setter, places) {
  const { page } = setter;
  const scoring = { rules: "ifsc-2025" };
  const made = await request(page, places.gym, "POST", "", {
    name: "Winter Cup", format: "rounds", categories: [{ name: "Open" }],
    rounds: [{ name: "Qualification", scoring, problems: [{ name: "A" }] }, { name: "Final", scoring, quota: 2, problems: [{ name: "B" }] }],
  });
  const { ask, entry, event } = over(page, places.gym, made.id);
  await ask("PUT", "/state", { state: "running" });
  for (const [at, name] of ["Dana Malá", "Emil Roth", "Fay Dubois"].entries()) {
    await event({ entry_id: await entry(name, made.categories[0].id), problem_id: made.rounds[0].problems[0].id, kind: "top", n: at + 1 });
  }
  await ask("PUT", `/rounds/${made.rounds[0].id}/state`, { state: "ended" });
  return `/g/${places.gym}/competitions/${made.id}`;
}

/** The wizard's steps for a lead competition: two routes, then a final on one; its address. */
async function madeLead(setter, places) {
  const { page } = setter;
  await setter.go(`/g/${places.gym}/competitions/new`);
  const on = () => page.getByRole("button", { name: "Continue" }).click();
  await page.getByLabel("Competition name").fill("Lead Cup");
  await page.getByRole("radio", { name: /^Another format/ }).check();
  await page.getByRole("radio", { name: "Rope climbing" }).check();
  await page.getByRole("radio", { name: /^Qualification and final/ }).check();
  await fine(setter, "lead-what");
  await on();
  await page.getByText("2 routes", { exact: true }).waitFor();
  await on();
  await page.getByLabel("Category name").first().waitFor();
  await on();
  await page.getByText("geometric mean of the ranks").first().waitFor();
  await page.getByText("Single routes: labels, holds, categories").first().click();
  const route = page.locator("details fieldset").first();
  await route.getByLabel("Number of holds").fill("40");
  await route.getByLabel("Women").check();
  await fine(setter, "lead-points");
  await route.getByLabel("Women").uncheck();
  await on();
  await on();
  await page.getByRole("button", { name: "Create competition" }).click();
  await page.getByRole("heading", { name: "Lead Cup" }).waitFor();
  return new URL(page.url()).pathname;
}

/** A judge counts holds as the climbers move, without reception. */
async function judgedLead(judge, place) {
  const { page, context, expected } = judge;
  await page.setViewportSize({ width: 360, height: 740 });
  await judge.go(`${place}/judge`);
  await page.locator("[data-kept=yes]").waitFor();
  await context.setOffline(true);
  await page.getByRole("main").locator("li a").first().click();
  const pad = (name) => page.getByRole("group", { name: new RegExp(`${name}.*Route|${name}`) }).first();
  const next = (name) => pad(name).getByRole("button", { name: "Next hold" });
  await page.getByRole("button", { name: /1 Dana/ }).last().click();
  await page.getByRole("button", { name: "Start clock" }).click();
  for (let hold = 0; hold < 12; hold += 1) await next("Dana").click();
  await pad("Dana").getByRole("button", { name: "Plus" }).click();
  await fine(judge, "lead-judge");
  await page.getByRole("button", { name: "Save 12+" }).click();
  await page.getByText(/12\+ · 0:\d\d: saved\./).waitFor();
  // One attempt: after it the pad is closed, until the judge undoes the entry.
  assert.equal(await page.getByRole("button", { name: "Next hold" }).count(), 0);
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByText("Undone.").waitFor();
  await pad("Dana").getByLabel("Hold of 40").fill("12");
  await page.getByLabel("Climbing time").last().fill("4:61");
  await page.getByText("Write the time as minutes and seconds").waitFor();
  await page.getByLabel("Climbing time").last().fill("4:12");
  await page.getByRole("button", { name: "Save 12" }).click();
  await page.getByText("12 · 4:12: saved.").waitFor();
  await page.getByRole("button", { name: "Next: 2 Emil" }).click();
  await pad("Emil").getByRole("button", { name: "Top" }).click();
  await page.getByRole("button", { name: "Save TOP" }).click();
  await page.getByRole("link", { name: "2 entries waiting to sync" }).waitFor();
  await fine(judge, "lead-judge-offline");
  await context.setOffline(false);
  await page.evaluate(() => dispatchEvent(new Event("online")));
  await page.getByText("Everything is synced.").waitFor();
  expected(OFFLINE);
  await page.getByRole("button", { name: /1 Dana/ }).last().click();
  await page.getByText("History (").click();
  await page.getByText("12, try 1 · 4:12").waitFor();
  await fine(judge, "lead-judge-history");
}

async function scored(climber, place) {
  const { page } = climber;
  await climber.go(`${place}/card`);
  await page.getByRole("main").locator("li button").nth(1).click();
  await page.getByRole("button", { name: "Flash", exact: true }).click();
  await page.getByText("Flash: saved.").waitFor();
  await page.getByText("Everything is synced.").waitFor();
  await fine(climber, "card");
  await page.getByText("Flash: saved.").waitFor(); // also when the card was loaded again
}

test("a competition from the wizard to the board", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  await signIn(setter, places, places.setter);
  const place = await made(setter, places);
  await listed(setter);
  await setter.go(place);
  await setter.page.getByRole("button", { name: "Open entries" }).click();
  const climber = await visit(browser, places);
  await signIn(climber, places, places.member);
  await entered(climber, place);
  await setter.page.getByRole("button", { name: "Start", exact: true }).click();
  await setter.page.getByText("The competition is running.").waitFor();
  await fine(setter, "front");
  await setter.close();

  const guest = await visit(browser, places, { dark: true });
  await guest.go(`${place}/board`);
  await guest.page.locator("[data-live=true]").waitFor();
  const judge = await visit(browser, places);
  await signIn(judge, places, places.judge);
  await judged(judge, places, place);
  // Without a reload.
  await guest.page.getByRole("row", { name: /^1 Chloé/ }).waitFor();
  await guest.page.getByRole("row", { name: /^2 Anna/ }).waitFor();
  await disqualified(judge, guest, place);
  await scored(climber, place);
  await climber.close();
  await guest.page.getByRole("button", { name: "Men", exact: true }).click();
  await guest.page.getByRole("row", { name: /^1 / }).getByText("120").waitFor();
  await guest.page.getByRole("button", { name: "Women" }).click();
  await guest.page.getByRole("button", { name: "Anna Svobodová" }).click();
  await guest.page.getByText("Why Chloé Roux ranks above Anna").waitFor();
  await fine(guest, "board");
  await guest.page.getByRole("button", { name: "Replay" }).click();
  await guest.page.getByRole("slider").fill("0"); // when it began
  await guest.page.getByText("You see the ranking at").waitFor();
  await fine(guest, "replay");

  const hall = await visit(browser, places, { phone: false });
  await hall.go(`${place}/board?projector`);
  await hall.page.getByRole("row", { name: /Chloé/ }).waitFor();
  assert.equal(await hall.page.getByRole("navigation").count(), 0);
  assert.deepEqual(await grave(hall.page), []);
  await hall.shot("competition-projector");
  await hall.close();

  await judge.go(`${place}/appeals`);
  await judge.page.getByLabel("Climber").selectOption({ label: "12 Béla Tóth" });
  await judge.page.getByLabel("Subject").fill("I held the zone.");
  await judge.page.getByRole("button", { name: "New appeal" }).click();
  await judge.page.getByText("I held the zone.").waitFor();
  await judge.page.getByLabel("Reason for the decision").fill("The film shows it.");
  await fine(judge, "appeals");
  await judge.page.getByRole("button", { name: "Uphold" }).click();
  await judge.page.getByText("Upheld").waitFor();
  await judge.close();
  await guest.close();
});

test("a final's running order is drawn, moved by keyboard, and seen", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  const { page } = setter;
  await signIn(setter, places, places.setter);
  const place = await qualified(setter, places);
  await setter.go(place);
  await page.getByRole("link", { name: "Running order" }).click();
  await page.getByRole("button", { name: "Final" }).click();
  await page.getByRole("button", { name: "Draw lots" }).click();
  const names = (of) => of.getByRole("main").locator("li .who").allInnerTexts();
  await page.getByLabel("Position of Emil Roth").waitFor();
  await becomes(() => names(page), ["2 Emil Roth", "1 Dana Malá"]); // the best last
  await page.getByLabel("Add a climber").selectOption({ label: "3 Fay Dubois" });
  const earlier = page.getByRole("button", { name: "Move Fay Dubois up" });
  await earlier.focus();
  await page.keyboard.press("Enter");
  await page.keyboard.press("Enter"); // the key keeps the focus
  await becomes(() => names(page), ["3 Fay Dubois", "2 Emil Roth", "1 Dana Malá"]);
  await page.getByLabel("Position of Emil Roth").fill("9");
  await page.keyboard.press("Tab");
  await fine(setter, "order-moved");
  await page.getByRole("button", { name: "Save order" }).click();
  await page.getByRole("button", { name: "Save order" }).waitFor({ state: "detached" });
  await setter.close();

  const guest = await visit(browser, places, { dark: true, locale: "fr" });
  await guest.go(`${place}/order`);
  await guest.page.getByRole("button", { name: "Final" }).click();
  await guest.page.getByText("Fay Dubois").waitFor();
  await becomes(() => names(guest.page), ["3 Fay Dubois", "1 Dana Malá", "2 Emil Roth"]);
  assert.equal(await guest.page.getByRole("spinbutton").count(), 0);
  await fine(guest, "order-seen");
  await guest.close();
});

test("a lead competition from the wizard to a final that the time decides", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  await signIn(setter, places, places.setter);
  const place = await madeLead(setter, places);
  const id = place.split("/").at(-1);
  const { ask, entry, event } = over(setter.page, places.gym, id);
  const sheet = await ask("GET", "");
  const [qualification, final] = sheet.rounds;
  assert.deepEqual(sheet.rounds.map(({ scoring, problems }) => [scoring.rules, problems.length]), [["ifsc-lead", 2], ["ifsc-lead", 1]]);
  await ask("PUT", "/state", { state: "running" });
  const entries = [];
  for (const name of ["Dana Malá", "Emil Roth"]) entries.push(await entry(name, sheet.categories[0].id));
  const judge = await visit(browser, places);
  await signIn(judge, places, places.judge);
  await judgedLead(judge, place);
  await judge.close();

  // On the second route the other one is better, so both have the same mean of ranks.
  const guest = await visit(browser, places, { dark: true });
  await guest.go(`${place}/board`);
  await guest.page.locator("[data-live=true]").waitFor();
  for (const [at, entry_id] of entries.entries()) await event({ entry_id, problem_id: qualification.problems[1].id, kind: "high", n: 1, hold: 20 - at });
  await guest.page.getByRole("row", { name: /^1= tied Dana.*1\.41 12 · 20/ }).waitFor();
  await guest.page.getByRole("button", { name: "Dana Malá" }).click();
  await guest.page.getByText("12 · 4:12 · rank 2").waitFor();
  await guest.page.getByText("are tied: all criteria are equal").waitFor();
  await fine(guest, "lead-board");
  await ask("PUT", `/rounds/${qualification.id}/state`, { state: "ended" });
  await ask("PUT", `/rounds/${final.id}/state`, { state: "running" });
  for (const [at, entry_id] of entries.entries()) await event({ entry_id, problem_id: final.problems[0].id, kind: "high", n: 1, hold: 31, plus: true, seconds: 252 - at });
  await guest.page.getByRole("row", { name: /^1 Emil.*31\+/ }).waitFor();
  await guest.page.getByText("Climbing time, Final: Emil Roth 4:11, Dana Malá 4:12").waitFor();
  await fine(guest, "lead-board-final");
  await setter.close();
  await guest.close();
});

test("climbers count their holds on a scorecard", async ({ browser, places }) => {
  const setter = await visit(browser, places);
  await signIn(setter, places, places.setter);
  const problems = [{ name: "Long", holds: 30 }, { name: "Steep", holds: 25 }];
  const made = await request(setter.page, places.gym, "POST", "", {
    name: "Rope Night", format: "festival", self_entry: true, self_scoring: true, categories: [{ name: "Open" }],
    rounds: [{ name: "Session", scoring: { rules: "lead-points" }, problems }],
  });
  await over(setter.page, places.gym, made.id).ask("PUT", "/state", { state: "running" });
  await setter.close();
  const climber = await visit(browser, places);
  await signIn(climber, places, places.member);
  await over(climber.page, places.gym, made.id).ask("PUT", "/mine", { category_id: made.categories[0].id });
  const { page } = climber;
  await climber.go(`/g/${places.gym}/competitions/${made.id}/card`);
  await page.getByRole("main").locator("li button").first().click();
  await page.getByLabel("Hold of 30").fill("17");
  await page.getByRole("button", { name: "Plus" }).click();
  assert.equal(await page.getByRole("button", { name: "Start clock" }).count(), 0);
  await fine(climber, "lead-card");
  await page.getByRole("button", { name: "Save 17+" }).click();
  await page.getByText("17+: saved.").waitFor();
  await page.getByText("Everything is synced.").waitFor();
  await page.getByLabel("Hold of 30").waitFor(); // a second attempt is possible
  assert.equal(await page.getByRole("button", { name: "Save 0" }).isDisabled(), true); // not by a second tap
  await climber.go(`/g/${places.gym}/competitions/${made.id}/board`);
  await page.getByRole("row", { name: /^1 member.*17\.5/ }).waitFor();
  await climber.close();
});
