// Lengths in metric units, and in feet and inches.

import assert from "node:assert/strict";
import { test } from "vitest";
import { inCentimetres, inMetres, measured } from "../../src/data/lengths";

const metric = { units: "metric", code: "en" };
const imperial = { units: "imperial", code: "en" };

test("a length is read in the units of the reader", () => {
  assert.deepEqual([inMetres(1.75, metric), inMetres(4, metric, 1), inMetres(2.5, metric, 0, 2)], ["1.75 m", "4.0 m", "2.5 m"]);
  assert.deepEqual([inCentimetres(0.453, metric), inCentimetres(0.0324, metric, 1)], ["45 cm", "3.2 cm"]);
  assert.deepEqual([measured(0.4531, metric), measured(4.0321, metric)], ["0.453 m", "4.03 m"]);
  assert.deepEqual([inMetres(1.75, imperial), inMetres(0.5, imperial), inMetres(0.1, imperial)], ["5 ft 9 in", "20 in", "3.9 in"]);
  assert.deepEqual([inCentimetres(0.453, imperial), inCentimetres(0.0324, imperial, 1)], ["18 in", "1.3 in"]);
  assert.deepEqual([measured(0.4531, imperial), measured(4.0321, imperial)], ["17.8 in", "13 ft 2.7 in"]);
  assert.equal(inMetres(1.828, imperial), "6 ft 0 in"); // never 5 ft 12 in
  // Below the floor.
  assert.deepEqual([inMetres(-2, imperial), inMetres(-0.1, imperial)], ["-6 ft 7 in", "-3.9 in"]);
  assert.equal(inMetres(1.75, { ...metric, code: "de" }), "1,75 m");
});
