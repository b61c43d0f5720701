// The keyboard's way from hold to hold.

import assert from "node:assert/strict";
import { test } from "vitest";
import { nearestTo, nextInDirection } from "../../src/input/hold_cursor";

const WAYS = ["left", "right", "up", "down"];

/** The same numbers from 0 to 1 on each run. */
function numbers(seed) {
  let state = seed;
  return () => (state = (state * 48271) % 2147483647) / 2147483647;
}

test("a step goes to the nearest place on its side", () => {
  const places = new Map([[1, { x: 0, y: 0 }], [2, { x: 50, y: 10 }], [3, { x: 20, y: -40 }], [4, { x: 90, y: 0 }]]);
  const from = (id, to) => nextInDirection(places, places.get(id), to);
  assert.equal(from(1, "right"), 2);
  assert.equal(from(1, "up"), 3);
  assert.equal(from(2, "right"), 4);
  assert.equal(from(4, "right"), null);
  assert.equal(nearestTo(places, { x: 45, y: 0 }), 2);
  assert.equal(nearestTo(new Map(), { x: 0, y: 0 }), null);
});

test("each place is reached from each other", () => {
  for (let seed = 1; seed <= 30; seed++) {
    const next = numbers(seed);
    const places = new Map(Array.from({ length: 3 + seed * 3 }, (_, id) => [id, { x: 800 * next(), y: 600 * next() }]));
    const after = new Map([...places].map(([id, place]) => [id, WAYS.map((way) => nextInDirection(places, place, way)).filter((one) => one !== null)]));
    for (const start of places.keys()) {
      const seen = new Set([start]);
      for (const id of seen) for (const one of after.get(id)) seen.add(one);
      assert.equal(seen.size, places.size, `seed ${seed}: some places are not reached from ${start}`);
    }
  }
});
