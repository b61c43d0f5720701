// Lines of the page over the picture.

import assert from "node:assert/strict";
import { test } from "vitest";
import { pathOf } from "../../src/scene/overlay";

/** Looks along y, with 100 pixels a metre. */
const project = ([x, y, z]) => ({ x: 100 * x, y: -100 * z, ahead: y > 0 });

test("each line is a part of the path", () => {
  const lines = [[[0, 1, 0], [1, 1, 0], [1, 1, 1]], [[2, 1, 0], [2, 1, 1]]];
  assert.equal(pathOf(lines, project), "M0.0 0.0L100.0 0.0L100.0 -100.0M200.0 0.0L200.0 -100.0");
});

test("a line is interrupted behind the camera", () => {
  const line = [[0, 1, 1], [1, 1, 1], [2, -1, 1], [3, 1, 1], [4, 1, 1]];
  assert.equal(pathOf([line], project), "M0.0 -100.0L100.0 -100.0M300.0 -100.0L400.0 -100.0");
});

test("no lines, no path", () => {
  assert.equal(pathOf([], project), "");
});
