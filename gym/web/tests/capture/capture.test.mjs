// What the capture page says: the measures of a frame, and the hints of an overlap.

import assert from "node:assert/strict";
import { test } from "vitest";
import { hintsOf } from "../../src/scans/capture/coverage";
import { greyOf, luminanceOf, rollOf, sharpnessOf, warningsOf } from "../../src/scans/capture/frame";

const GOOD = { sharpness: 200, luminance: 118, roll: 2, rotation: 3 };

function picture(width, height, value) {
  const values = new Uint8ClampedArray(width * height);
  for (let at = 0; at < values.length; at++) values[at] = value(at % width, Math.floor(at / width));
  return { width, height, values };
}

test("sharpness is the variance of the Laplacian", () => {
  assert.equal(sharpnessOf(picture(20, 10, () => 90)), 0);
  assert.equal(sharpnessOf(picture(20, 10, (x) => 5 * x)), 0); // a ramp has no edge
  // A chessboard of 100 and 104: each Laplacian is +16 or -16.
  assert.equal(sharpnessOf(picture(20, 10, (x, y) => 100 + 4 * ((x + y) % 2))), 256);
  assert.equal(sharpnessOf(picture(2, 2, () => 9)), 0);
});

test("grey is weighted as the eye sees", () => {
  const grey = greyOf({ width: 2, height: 1, data: new Uint8ClampedArray([255, 0, 0, 255, 0, 255, 0, 255]) });
  assert.deepEqual([...grey.values], [76, 150]);
  assert.equal(luminanceOf(grey), 113);
});

test("roll is the distance from the nearest quarter turn", () => {
  assert.ok(rollOf(90, 0) < 1e-9); // upright
  assert.ok(rollOf(70, 0) < 1e-9); // tilted up
  assert.ok(rollOf(0, 90) < 1e-9); // lengthwise
  assert.ok(rollOf(0, -90) < 1e-9);
  assert.equal(rollOf(0, 0), null); // flat on a table: there is no roll
  // Upright, then turned in the picture's plane by 20°.
  const [b, g] = [Math.asin(Math.cos((20 * Math.PI) / 180)), 90];
  assert.ok(Math.abs(rollOf((b * 180) / Math.PI, g) - 20) < 1e-6);
});

test("a good moment has no warning, each fault has its own", () => {
  assert.deepEqual(warningsOf(GOOD, []), []);
  assert.deepEqual(warningsOf({ ...GOOD, roll: null, rotation: null }, []), []);
  assert.deepEqual(warningsOf({ ...GOOD, luminance: 20 }, []), ["dark"]);
  assert.deepEqual(warningsOf({ ...GOOD, luminance: 240 }, []), ["bright"]);
  assert.deepEqual(warningsOf({ ...GOOD, sharpness: 2.9 }, []), ["blur"]);
  assert.deepEqual(warningsOf({ ...GOOD, roll: 16 }, []), ["tilt"]);
  assert.deepEqual(warningsOf({ ...GOOD, rotation: 25 }, []), ["motion"]);
  // As a scan drops it: below 4 % of the median of the photos.
  assert.deepEqual(warningsOf({ ...GOOD, sharpness: 30 }, [1000, 1000]), []);
  assert.deepEqual(warningsOf({ ...GOOD, sharpness: 30 }, [1000, 10, 1000]), ["blur"]);
});

const photos = (count, plate_frames = 0) => Array.from({ length: count }, (_, number) => ({ id: `p${number}`, plate_frames }));
const walk = (count, right = 0.3, up = 0) => ({
  pending: false,
  groups: [photos(count).map(({ id }) => id)],
  shifts: Array.from({ length: count - 1 }, (_, number) => ({ before: `p${number}`, after: `p${number + 1}`, right, up })),
});
const names = (...given) => hintsOf(...given).map(({ name }) => name);

test("without an answer there is no hint", () => {
  assert.deepEqual(names([], null, true), []);
  assert.deepEqual(names(photos(3), null, true), []);
  assert.deepEqual(names(photos(3), { ...walk(3, 0.8), pending: true }, true), []);
  assert.deepEqual(names(photos(3), { pending: false, groups: [], shifts: [] }, true), []);
  assert.deepEqual(names(photos(4), walk(3, 0.8), true), []); // of photos before the last one came
});

test("a photo apart is reported, without a direction", () => {
  assert.deepEqual(names(photos(3), { pending: false, groups: [["p0", "p1"], ["p2"]], shifts: walk(2).shifts }, true), ["apart"]);
  assert.deepEqual(names(photos(3), { pending: false, groups: [["p1", "p2"], ["p0"]], shifts: [] }, true), []);
});

test("too wide a step leads back to where it came from", () => {
  assert.deepEqual(names(photos(3), walk(3, 0.6), true), ["stepLeft"]);
  assert.deepEqual(names(photos(3), walk(3, -0.6), true), ["stepRight"]);
  assert.deepEqual(names(photos(3), walk(3, 0), true), []); // a step around the same spot moves the picture's middle by nothing
  assert.deepEqual(names(photos(3), walk(3, 0.3), true), []);
});

test("one row of photos asks for a higher one", () => {
  assert.deepEqual(names(photos(6), walk(6), true), ["higher"]);
  assert.deepEqual(names(photos(6), walk(6, 0.3, 0.1), true), []);
  assert.deepEqual(names(photos(5), walk(5), true), []);
});

test("the plate is counted until three photos show it", () => {
  assert.deepEqual(hintsOf(photos(2), null, false), [{ name: "plateUnseen" }]);
  assert.deepEqual(hintsOf(photos(2, 1), null, false), [{ name: "plate", count: 2 }]);
  assert.deepEqual(hintsOf(photos(3, 1), null, false), []);
  assert.deepEqual(hintsOf([], null, false), []);
  assert.deepEqual(hintsOf(photos(2), null, true), []); // a registered scan needs none
});
