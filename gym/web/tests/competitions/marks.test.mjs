// Marks on routes in the app, as the server makes them of the same events (`competitions/ledger.py`).

import assert from "node:assert/strict";
import { test } from "vitest";
import { highText, markOf, timeOf, timeText } from "../../src/competitions/marks";

const event = (id, kind, n, more = {}) => ({ id, kind, n, target_id: null, ...more });

const EVENTS = [
  event("a", "high", 1, { hold: 21, plus: true, seconds: 130 }),
  event("b", "high", 1, { hold: 21, plus: true, seconds: 128 }),
  event("c", "high", 1, { hold: 21, seconds: 90 }),
  event("d", "high", 2, { hold: 7, seconds: 40 }),
  event("e", "top", 3, { seconds: 200 }),
  event("f", "void", null, { target_id: "e" }),
];

test("the best high point counts in any order of events", () => {
  const wanted = { tries: 2, zone: 0, top: 0, hold: 21, plus: true, highTry: 1, seconds: 128 };
  for (let turn = 0; turn < EVENTS.length; turn += 1) {
    const order = [...EVENTS.slice(turn), ...EVENTS.slice(0, turn)];
    assert.deepEqual(markOf(order), wanted);
    assert.deepEqual(markOf(order.reverse()), wanted);
  }
  assert.deepEqual(markOf(EVENTS.slice(0, 5)), { tries: 3, zone: 3, top: 3, hold: 0, plus: false, highTry: 0, seconds: 200 });
  assert.deepEqual(markOf([event("a", "high", 1, { hold: 0 })]).highTry, 1);
});

test("a correction replaces a high point", () => {
  const found = markOf([event("a", "high", 1, { hold: 30 }), event("b", "high", 1, { hold: 29, plus: true, target_id: "a" })]);
  assert.equal(highText({ ...found, top: found.top > 0 }), "29+");
});

test("a boulder's mark has no high point", () => {
  assert.deepEqual(markOf([event("a", "zone", 2), event("b", "top", 3)]), { tries: 3, zone: 2, top: 3, hold: 0, plus: false, highTry: 0, seconds: null });
});

test("times are written as minutes and seconds", () => {
  for (const [text, seconds] of [["4:12", 252], ["252", 252], [" 0:07 ", 7], ["60:00", 3600]]) assert.equal(timeOf(text), seconds);
  for (const text of ["", "4:60", "4.12", "0", "61:00", "x"]) assert.equal(timeOf(text), null, text);
  assert.deepEqual([7, 252, 3600].map(timeText), ["0:07", "4:12", "60:00"]);
});

test("attempts beyond the limit do not count", () => {
  assert.equal(markOf([event("a", "zone", 2), event("b", "top", 3)], 2).top, 0);
  assert.equal(markOf([event("a", "zone", 2), event("b", "top", 3)], 3).top, 3);
});
