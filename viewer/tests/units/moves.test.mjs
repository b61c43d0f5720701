// Which of the computed bodies stands for a person.

import assert from "node:assert/strict";
import { test } from "vitest";
import { nearestClimber } from "../../src/moves/moves_file";

const CLIMBERS = [1.55, 1.75, 1.9].map((height_m) => ({ height_m, span_m: height_m }));
const nearest = (height_m, span_m) => nearestClimber(CLIMBERS, { height_m, span_m }).height_m;

test("the nearest height, where the arm span is as the height", () => {
  assert.deepEqual([1.2, 1.6, 1.64, 1.66, 1.8, 1.84, 2.1].map((height) => nearest(height)), [1.55, 1.55, 1.55, 1.75, 1.75, 1.9, 1.9]);
});

test("long arms count for height", () => {
  assert.equal(nearest(1.64, 1.7), 1.75);
  assert.equal(nearest(1.66, 1.6), 1.55);
  assert.equal(nearest(1.75, null), 1.75);
});
