// Moments in a gym's time zone, wherever the reader is.

import assert from "node:assert/strict";
import { test, vi } from "vitest";
import { fieldIn, momentIn, zonedMoment, zoneName } from "../../src/lib/zones";

// Its state needs the Svelte compiler.
vi.mock("../../src/i18n.svelte", () => ({ locale: () => "en-GB" }));

test("a competition's time is the gym's, and says its zone", () => {
  const shown = zonedMoment("2026-11-26T17:00:00Z", "Europe/Prague");
  assert.match(shown, /18:00/);
  assert.match(shown, /CET|GMT\+1/);
  assert.match(zoneName("2026-07-01T12:00:00Z", "Europe/Prague"), /CEST|GMT\+2/);
});

for (const [field, zone, moment] of [
  ["2026-11-26T18:00", "Europe/Prague", "2026-11-26T17:00:00.000Z"],
  ["2026-07-26T00:30", "Europe/Prague", "2026-07-25T22:30:00.000Z"],
  ["2026-03-29T03:30", "Europe/Prague", "2026-03-29T01:30:00.000Z"],
  ["2026-10-25T03:30", "Europe/Prague", "2026-10-25T02:30:00.000Z"],
  ["2026-11-26T18:00", "America/Los_Angeles", "2026-11-27T02:00:00.000Z"],
  ["2026-01-01T00:00", "Asia/Kathmandu", "2025-12-31T18:15:00.000Z"],
]) {
  test(`${field} in ${zone} goes to the server and comes back`, () => {
    assert.equal(momentIn(field, zone), moment);
    assert.equal(fieldIn(moment, zone), field);
  });
}

test("an empty field is no moment", () => {
  assert.deepEqual([momentIn("", "UTC"), fieldIn(null, "UTC")], [null, ""]);
});
