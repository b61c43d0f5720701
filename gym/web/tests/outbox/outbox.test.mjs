// Entries of this browser arrive at the server once, whatever network, tabs and taps do.

import assert from "node:assert/strict";
import { test } from "vitest";
import { breath, newBrowser } from "./browser.mjs";
import { Network, Server } from "./server.mjs";
import { ascent, body, byLink, climbed, many, mark, problem, score } from "./words.mjs";

/** A browser with a tab, and a server behind a network with one fate; the session can be read unless all is down. */
async function place(fate = "fine") {
  const browser = newBrowser();
  const server = new Server();
  const network = new Network(server, ({ path }) => ({ fate: path === "/me" && network.now !== "down" ? "fine" : network.now }));
  network.now = fate;
  return { browser, server, network, tab: await browser.tab() };
}

test("what was said without reception is sent in the order in which it was said", async () => {
  const { server, network, tab, browser } = await place("down");
  const entered = Array.from({ length: 10 }, (_, at) => `${9 - at}-ascent`); // not the order of their names
  for (const id of entered) {
    await tab.keep(ascent(id));
    browser.turn(60_000);
    assert.equal(await tab.send(), "later");
  }
  network.now = "fine";
  assert.equal(await tab.send(), "empty");
  assert.deepEqual(server.reached.map(({ id }) => id), entered);
  assert.equal(await tab.send(), "empty");
  assert.equal(server.reached.length, 10);
});

for (const fate of ["fine", "lost", "broken", "twice", "late"]) {
  test(`a list whose first sending is ${fate} arrives once, and can be withdrawn`, async () => {
    const { server, network, tab } = await place(fate);
    await tab.keep(many("m", ["a", "b"]));
    await tab.send();
    network.now = "fine";
    assert.equal(await tab.send(), "empty");
    assert.deepEqual([...server.ascents.keys()], ["a", "b"]);
    await tab.keep(many("m", ["a", "b"], { takenBack: true }));
    assert.equal(await tab.send(), "empty");
    while (network.late.length) network.deliver(0);
    assert.deepEqual([...server.ascents.values()].map(({ gone }) => gone), [true, true]);
  });
}

for (const fate of ["fine", "lost", "broken", "twice", "late", "down", "portal"]) {
  test(`a mark whose first sending is ${fate} arrives once, with its photo`, async () => {
    const { server, network, tab } = await place(fate);
    await tab.keep(mark("m", { photo: new Blob(["12345"], { type: "image/jpeg" }) }));
    await tab.keep(mark("n"));
    await tab.send();
    network.now = "fine";
    assert.equal(await tab.send(), "empty");
    while (network.late.length) network.deliver(0);
    assert.deepEqual([...server.marks.keys()].sort(), ["m", "n"]);
    assert.equal(server.marks.get("m").words.photo, "image/jpeg 5");
    assert.ok(server.marks.get("m").number < server.marks.get("n").number);
    assert.equal(server.photos.size, 1);
  });
}

test("a list with a wrong day is kept whole, with the reason", async () => {
  const { server, tab } = await place();
  server.wrong.add("b");
  await tab.keep(many("m", ["a", "b"]));
  assert.equal(await tab.send(), "empty");
  assert.equal(server.ascents.size, 0);
  assert.equal((await tab.all())[0].refused.status, 422);
});

test("two tabs that send at once send each once", async () => {
  const { server, tab, browser } = await place();
  const other = await browser.tab();
  for (let number = 0; number < 6; number++) await (number % 2 ? tab : other).keep(ascent(`a${number}`));
  assert.deepEqual(await Promise.all([tab.send(), other.send(), tab.send()]), ["empty", "empty", "empty"]);
  assert.equal(server.reached.length, 6);
});

for (const fate of ["lost", "broken", "twice", "late"]) {
  test(`an ascent whose first sending is ${fate} is there once, and the last edit of it counts`, async () => {
    const { server, network, tab } = await place(fate);
    await tab.keep(ascent("a", { kind: "try" }));
    await tab.send();
    await tab.keep(ascent("a", { kind: "top", tries: 2 }));
    network.now = "fine";
    assert.equal(await tab.send(), "empty");
    while (network.late.length) network.deliver(0);
    assert.deepEqual([...server.ascents.keys()], ["a"]);
    assert.deepEqual(server.ascents.get("a").words, body("r1", "top", 2));
  });
}

test("the answer to what was said before settles nothing of what is said meanwhile", async () => {
  for (const takenBack of [false, true]) {
    const { server, network, tab } = await place();
    let answer;
    network.fate = ({ path }) => ({ fate: "fine", pause: path === "/me" || answer ? undefined : new Promise((resolve) => (answer = resolve)) });
    await tab.keep(ascent("a", { kind: "try" }));
    const sending = tab.send();
    while (!answer) await breath();
    await tab.keep(ascent("a", { kind: "top", tries: 2, takenBack }));
    answer();
    assert.equal(await sending, "empty");
    const { gone, words } = server.ascents.get("a");
    assert.deepEqual([gone, words], [takenBack || undefined, body("r1", "top", 2)]);
    assert.equal(server.reached.length, takenBack ? 3 : 2);
  }
});

test("what is taken back before it left is never sent", async () => {
  const { server, tab } = await place();
  await tab.keep(ascent("a"));
  await tab.keep(ascent("a", { takenBack: true }));
  assert.equal(await tab.send(), "empty");
  assert.deepEqual(server.reached, []);
  assert.deepEqual(await tab.all(), []);
});

for (const fate of ["lost", "broken", "late", "busy"]) {
  test(`what is taken back after a sending that was ${fate} is taken back at the server, a late copy brings it not again`, async () => {
    const { server, network, tab } = await place();
    network.now = fate;
    await tab.keep(ascent("a"));
    assert.equal(await tab.send(), "later");
    await tab.keep(ascent("a", { takenBack: true }));
    network.now = "fine";
    assert.equal(await tab.send(), "empty");
    while (network.late.length) network.deliver(0);
    assert.equal(server.ascents.get("a").gone, true);
  });
}

test("a score event that waits can be withdrawn, one that may have been sent is struck by another one after it", async () => {
  const { server, network, tab } = await place("down");
  await tab.keep(score("zone"));
  assert.equal(await tab.withdraw((await tab.all())[0]), true);
  assert.deepEqual(await tab.all(), []);
  network.now = "lost";
  await tab.keep(score("top"));
  assert.equal(await tab.send(), "later");
  assert.equal(await tab.withdraw((await tab.all())[0]), false);
  // Of the two only the void gets through at first, and it waits all the same.
  await tab.keep(score("undo", "top"));
  network.fate = ({ path }) => ({ fate: path.endsWith("/top") ? "busy" : "fine" });
  assert.equal(await tab.send(), "later");
  assert.equal(server.events.has("undo"), false);
  network.fate = () => ({ fate: "fine" });
  assert.equal(await tab.send(), "empty");
  assert.deepEqual([...server.events.keys()], ["top", "undo"]);
});

test("what is refused is kept with the reason and not sent again; said otherwise it is", async () => {
  const { server, tab } = await place();
  server.unwanted.add("a");
  await tab.keep(ascent("a"));
  await tab.send();
  await tab.send();
  assert.equal(server.reached.length, 1);
  const [item] = await tab.all();
  assert.deepEqual(item.refused, { status: 403, message: "not this one", hint: "", body: { title: "not this one" } });
  server.unwanted.clear();
  await tab.keep(ascent("a", { kind: "zone" }));
  await tab.send();
  assert.equal(server.ascents.get("a").words.kind, "zone");
});

test("an ascent of an impossible day is kept with the reason, blocks no other, and can be withdrawn", async () => {
  const { server, tab } = await place();
  server.wrong.add("a");
  await tab.keep(ascent("a"));
  await tab.keep(ascent("b", { route: "r2" }));
  assert.equal(await tab.send(), "empty");
  assert.deepEqual([...server.ascents.keys()], ["b"]);
  const { refused } = (await tab.all()).find(({ id }) => id === "a");
  assert.deepEqual([refused.status, refused.body.code, refused.body.values], [422, "ascent-too-early", { day: "1970-01-01" }]);
  await tab.keep(ascent("a", { takenBack: true, known: true }));
  assert.equal(await tab.send(), "empty");
  assert.deepEqual((await tab.all()).filter((item) => item.refused), []);
});

test("nobody's ascents are sent in another one's name, not even when the other one signs in meanwhile", async () => {
  const { server, network, tab } = await place();
  await tab.keep(ascent("a1"));
  await tab.keep(ascent("a2"));
  network.fate = ({ path }) => {
    if (path.endsWith("/a2")) server.person = "eve"; // signed in between the two
    return { fate: "fine" };
  };
  assert.equal(await tab.send(), "sign-in");
  assert.equal(await tab.send(), "empty"); // nothing of Eve's
  assert.deepEqual([...server.ascents.keys()], ["a1"]);
  network.fate = () => ({ fate: "fine" });
  server.person = null;
  assert.equal(await tab.send(), "sign-in");
  server.person = "ada";
  assert.equal(await tab.send(), "empty");
  assert.deepEqual([...server.ascents].map(([id, { person }]) => [id, person]), [["a1", "ada"], ["a2", "ada"]]);
});

test("edits of one browser are numbered one after the other, in all tabs, by a clock that is set back too", async () => {
  const { browser, tab } = await place();
  const other = await browser.tab();
  const edits = await Promise.all(Array.from({ length: 20 }, (_, at) => (at % 2 ? tab : other).nextEdit()));
  browser.turn(-86_400_000);
  edits.push(await tab.nextEdit());
  assert.deepEqual(edits.map(({ number }) => number).sort((a, b) => a - b), Array.from({ length: 21 }, (_, at) => at + 1));
  assert.equal(new Set(edits.map(({ device }) => device)).size, 1);
});

test("tries of a day are one line that a top closes; a project is marked and unmarked", async () => {
  const { tab } = await place();
  const [now, yesterday] = [new Date("2026-11-20T18:00:00"), new Date("2026-11-19T18:00:00")];
  const row = ({ id, after }) => ({ ...after, id, waits: true, known: false });
  const first = row(tab.change("r1", { kind: "try", discipline: "boulder" }, [], yesterday, "a"));
  const second = row(tab.change("r1", { kind: "try", discipline: "boulder" }, [first], now, "b"));
  assert.deepEqual([second.id, second.tries], ["b", 1]);
  const third = tab.change("r1", { kind: "try", discipline: "boulder" }, [first, second], now, "c");
  const top = tab.change("r1", { kind: "top", discipline: "boulder" }, [first, row(third)], now, "d");
  assert.deepEqual([top.id, top.after.kind, top.after.tries, top.before.kind], ["b", "top", 3, "try"]);
  const next = tab.change("r1", { kind: "top", discipline: "boulder" }, [first, row(top)], now, "e");
  assert.deepEqual([next.id, next.after.tries, next.before], ["e", 1, null]);
  const project = tab.change("r1", { kind: "project", discipline: "boulder" }, [first], now, "f");
  const off = tab.change("r1", { kind: "project", discipline: "boulder" }, [first, { ...row(project), known: true }], now, "g");
  assert.deepEqual([project.id, off.id, off.after, off.known], ["f", "f", null, true]);
});

test("a try on one rope is not counted up by a climb on another", async () => {
  const tab = await import("./tab.ts");
  const now = new Date("2026-11-24T18:00:00Z");
  const fell = tab.change("r1", { kind: "try", discipline: "lead" }, [], now, "a");
  const own = [{ ...fell.after, id: "a", waits: false, known: true }];
  assert.equal(tab.change("r1", { kind: "top", discipline: "top-rope" }, own, now, "b").id, "b");
  const high = tab.change("r1", { kind: "high-point", discipline: "lead", clip: 5 }, own, now, "c");
  assert.deepEqual([high.id, high.after.kind, high.after.tries, high.after.high_point], ["a", "high-point", 2, 5]);
  const next = tab.change("r1", { kind: "top", discipline: "lead" }, own, now, "d");
  assert.deepEqual([next.id, next.after.high_point], ["a", null]);
});

test("what the server had taken when it was asked goes when it shows it, and nothing else", async () => {
  const { tab } = await place();
  await tab.keep(ascent("a"));
  await tab.send();
  const requested = Date.now();
  await tab.keep(ascent("b"));
  await tab.settle(requested, () => true);
  assert.deepEqual((await tab.all()).map(({ id }) => id), ["b"]);
  await tab.send();
  await tab.settle(requested, () => true); // it was taken after that
  assert.deepEqual((await tab.all()).map(({ id }) => id), ["b"]);
});

for (const fate of ["fine", "lost", "late", "busy"]) {
  test(`a problem that is deleted after a sending that was ${fate} stays deleted`, async () => {
    const { server, network, tab } = await place(fate);
    await tab.keep(problem("a"));
    await tab.send();
    await tab.keep(problem("a", { takenBack: true }));
    network.now = "fine";
    assert.equal(await tab.send(), "empty");
    while (network.late.length) network.deliver(0);
    assert.equal(server.problems.get("a").gone, true);
  });
}

test("a problem that the server refuses, since its holds are gone, is deleted", async () => {
  const { server, tab } = await place();
  await tab.keep(problem("a", { takenBack: true, known: true }));
  server.take = ({ method, path }) => (path === "/me" ? { status: 200, body: { id: "ada" } } : { status: method === "PUT" ? 422 : 404, body: {} });
  assert.equal(await tab.send(), "empty");
  assert.deepEqual((await tab.all()).map(({ refused }) => refused), [null]);
});

test("that one climbed a problem is sent after the problem", async () => {
  const { server, network, tab } = await place();
  network.fate = ({ path }) => ({ fate: path.endsWith("/problems/a") ? network.now : "fine" });
  network.now = "busy";
  await tab.keep(climbed("b")); // of another wall, which the server has
  server.problems.set("b", { person: "eve", number: 0, edits: [] });
  await tab.keep(problem("a"));
  await tab.keep(climbed("a"));
  await tab.send();
  assert.deepEqual([...server.climbed.keys()], ["ada/b"]);
  network.now = "fine";
  await tab.send();
  assert.deepEqual([...server.climbed.keys()], ["ada/b", "ada/a"]);
});

test("a score by a judge's link needs no account, and an account's scores wait for theirs", async () => {
  const { server, tab } = await place();
  server.person = "";
  server.links.add("one");
  await tab.keep(score("a"));
  await tab.keep(byLink("b", "two")); // this browser has not opened that link
  await tab.keep(byLink("c", "one"));
  await tab.keep(byLink("d", "one", "c"));
  assert.equal(await tab.send(), "sign-in");
  assert.deepEqual(server.reached.map(({ id }) => id), ["c", "d"]);
  server.person = "ada";
  server.links.add("two");
  assert.equal(await tab.send(), "empty");
  assert.deepEqual(server.reached.map(({ id }) => id), ["c", "d", "a", "b"]);
  assert.deepEqual([...server.events.values()].map(({ person }) => person), ["link one", "link one", "ada", "link two"]);
});
