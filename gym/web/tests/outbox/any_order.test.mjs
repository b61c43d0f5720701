// Whatever two people tap, in any order, with two tabs and a bad network: in the end the server has the last edits, once. Random by
// seed; a failure names its seed.

import assert from "node:assert/strict";
import { test } from "vitest";
import { breath, newBrowser } from "./browser.mjs";
import { FATES, Network, Server } from "./server.mjs";
import { ascent, list, many, opinion, problem, score } from "./words.mjs";

/** Pseudorandom numbers, the same for a seed (mulberry32). */
function chance(seed) {
  let state = seed;
  const next = () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
  return { below: (most) => Math.floor(next() * most), of: (list) => list[Math.floor(next() * list.length)] };
}

/** A random number of pauses, so that sendings and taps interleave. */
async function breaths(number) {
  for (let left = number; left > 0; left--) await breath();
}

class Evening {
  /** The last edit, by the key of the item. */
  entered = new Map();
  /** Ids that never left before they were withdrawn. */
  never = new Set();
  sendings = new Set();
  count = 0;

  constructor(random, browser, server, network, tabs) {
    Object.assign(this, { random, browser, server, network, tabs });
  }

  async say(words) {
    const tab = this.random.of(this.tabs);
    this.entered.set(tab.keyOf(words), words);
    await tab.keep(words);
  }

  /** A person taps, the network changes, a tab sends. */
  async step() {
    const { random, server, network, tabs } = this;
    const person = random.of(["ada", "ada", "eve"]);
    const earlier = random.of([...this.entered.values()].filter((words) => words.person === person));
    const steps = [
      () => this.say(ascent(`a${this.count++}`, { route: `r${random.below(3)}`, person })),
      () => this.say(many(`m${this.count++}`, [`m${this.count}-1`, `m${this.count}-2`], { route: `r${random.below(3)}`, person })),
      () => earlier?.what === "ascents" && !earlier.takenBack && this.takeBack(earlier),
      () => this.say(opinion(`r${random.below(3)}`, random.below(5) + 1, person)),
      () => this.say(score(`s${this.count++}`, null, person)),
      () => this.say(problem(`p${this.count++}`, { person })),
      () => this.say(list(`l${this.count++}`, this.problemsOf(person), { person })),
      () => earlier?.what === "list" && !earlier.takenBack && this.reorder(earlier),
      () => ["problem", "list"].includes(earlier?.what) && !earlier.takenBack && !this.isListed(earlier.id) && this.takeBack(earlier),
      () => earlier?.what === "ascent" && !earlier.takenBack && this.edit(earlier),
      () => earlier?.what === "ascent" && !earlier.takenBack && this.takeBack(earlier),
      () => earlier?.what === "score" && !earlier.body.target_id && this.say(score(`v${this.count++}`, earlier.id, person)),
      () => this.send(),
      () => this.send(),
      () => network.late.length && network.deliver(random.below(network.late.length)),
      () => random.of(tabs).settle(Date.now(), () => true),
      () => (server.person = random.of(["ada", "ada", "eve", null])),
      () => this.browser.turn(random.below(2) ? 60_000 : -60_000),
    ];
    await random.of(steps)();
    await breaths(random.below(6));
  }

  /** The waiting items of an ascent, and whether the server may have them, as the logbook says. */
  async shown({ id }) {
    const item = (await this.tabs[0].all()).find((row) => row.id === id);
    return { item, known: !item || item.known || item.sent > 0 };
  }

  async edit(words) {
    const { known } = await this.shown(words);
    await this.say(ascent(words.id, { ...words, kind: "top", tries: words.body.tries + 1, known }));
  }

  /** Problems of a person that are not withdrawn, with a route. */
  problemsOf(person) {
    const mine = [...this.entered.values()].filter((words) => words.what === "problem" && words.person === person && !words.takenBack);
    return ["r1", ...mine.map(({ id }) => id)];
  }

  isListed(id) {
    return [...this.entered.values()].some(({ what, body }) => what === "list" && body.items.includes(id));
  }

  async reorder(words) {
    const { known } = await this.shown(words);
    await this.say(list(words.id, words.body.items.toReversed(), { ...words, known }));
  }

  /** A withdrawn ascent stays so: undoing that makes a new one. */
  async takeBack(words) {
    const isIdle = this.sendings.size === 0;
    const { known } = await this.shown(words);
    if (isIdle && !known && words.what !== "ascents") this.never.add(words.id);
    await this.say({ ...words, takenBack: true, known });
  }

  send() {
    const sending = this.random.of(this.tabs).send();
    this.sendings.add(sending);
    void sending.finally(() => this.sendings.delete(sending));
  }

  /** Reception is back for both people, one after the other, and pending copies arrive. */
  async end() {
    await Promise.all(this.sendings);
    this.network.fate = () => ({ fate: "fine" });
    for (const person of ["ada", "eve"]) {
      this.server.person = person;
      for (let turn = 0; turn < 3; turn++) assert.deepEqual(await Promise.all(this.tabs.map((tab) => tab.send())), this.tabs.map(() => "empty"));
      while (this.network.late.length) this.network.deliver(this.random.below(this.network.late.length));
    }
  }

  async check() {
    const { server, entered } = this;
    assert.deepEqual((await this.tabs[0].all()).filter(({ done, refused }) => done === null || refused), []);
    const wished = [...entered.values()];
    for (const words of wished.filter(({ what }) => what === "ascent")) this.checkAscent(words);
    for (const list of wished.filter(({ what }) => what === "ascents")) {
      for (const row of list.rows) this.checkAscent({ ...row, person: list.person, takenBack: list.takenBack });
    }
    for (const words of wished.filter(({ what }) => what === "opinion")) {
      const row = server.opinions.get(`${words.person}/${words.route}`);
      assert.deepEqual(row?.words, words.body);
    }
    for (const words of wished.filter(({ what }) => what === "problem" || what === "list")) this.checkOwn(words);
    const events = wished.filter(({ what }) => what === "score");
    assert.deepEqual([...server.events.keys()].sort(), events.map(({ id }) => id).sort());
    for (const { person, id, body: words } of events) assert.deepEqual(server.events.get(id), { person, words });
    for (const row of [...server.ascents.values(), ...server.opinions.values(), ...server.problems.values(), ...server.lists.values()]) {
      assert.deepEqual(row.edits, [...new Set(row.edits)].sort((a, b) => a - b));
    }
  }

  checkAscent(words) {
    this.checkRow(this.server.ascents.get(words.id), words);
  }

  checkOwn(words) {
    this.checkRow(this.server[`${words.what}s`].get(words.id), words);
  }

  checkRow(row, words) {
    if (words.takenBack) assert.ok(row === undefined || row.gone, `${words.id} is taken back`);
    else assert.deepEqual([row?.person, row?.gone, row?.words], [words.person, undefined, words.body], words.id);
    if (this.never.has(words.id)) assert.ok(!this.network.requested.has(words.id), `${words.id} never left`);
  }
}

const RUNS = Number(process.env.WALLTOPO_OUTBOX_RUNS ?? 60);

for (const locks of [true, false]) {
  test(`any order of taps, tabs, sign-ins and troubles ends with the last edits (${locks ? "with" : "without"} Web Locks)`, async () => {
    for (let seed = 1; seed <= RUNS; seed++) {
      const random = chance(seed);
      const browser = newBrowser({ locks });
      const server = new Server();
      const network = new Network(server, () => ({ fate: random.of(Object.keys(FATES)), pause: breaths(random.below(40)) }));
      const evening = new Evening(random, browser, server, network, [await browser.tab(), await browser.tab()]);
      try {
        for (let step = 0; step < 40; step++) await evening.step();
        await evening.end();
        await evening.check();
      } catch (error) {
        error.message = `seed ${seed}: ${error.message}`;
        throw error;
      }
    }
  });
}
