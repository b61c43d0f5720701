// How large textures may be, by device.

import assert from "node:assert/strict";
import { test } from "vitest";
import { longestSide } from "../../src/tiers/texture_size";

test("small devices get textures of at most 2048 pixels", () => {
  assert.equal(longestSide(16384, { memory: undefined, side: 390 }), 2048); // an iPhone
  assert.equal(longestSide(16384, { memory: 4, side: 390 }), 2048);
  assert.equal(longestSide(16384, { memory: 2, side: 1024 }), 2048);
});

test("others get what the GPU can take", () => {
  assert.equal(longestSide(16384, { memory: 8, side: 390 }), 16384);
  assert.equal(longestSide(8192, { memory: undefined, side: 900 }), 8192);
  assert.equal(longestSide(1024, { memory: 2, side: 390 }), 1024);
});
