// The hint at the Home Screen: in Safari on iOS alone, until it is dismissed.

import assert from "node:assert/strict";
import { test, vi } from "vitest";
import { dismiss, isSuggested } from "../../src/shell/homeScreen";

test("it is for Safari on iOS, outside of the Home Screen, once", () => {
  const kept = new Map();
  vi.stubGlobal("localStorage", { getItem: (key) => kept.get(key) ?? null, setItem: (key, value) => kept.set(key, value) });
  assert.equal(isSuggested({}), false); // any other browser
  assert.equal(isSuggested({ standalone: true }), false);
  assert.equal(isSuggested({ standalone: false }), true);
  dismiss();
  assert.equal(isSuggested({ standalone: false }), false);
});
