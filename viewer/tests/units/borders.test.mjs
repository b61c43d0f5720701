// The smooth borders of holds: of a disc whose border follows a grid's triangles.

import assert from "node:assert/strict";
import { test } from "vitest";
import { bordersOf } from "../../src/geometry/hold_borders";

const CELLS = 60;
const RADIUS = 15.3; // cells
const MIDDLE = 30;

/** A flat grid with a disc as hold 1, a scrap of it far away and a pinhole in it; split at borders. */
function disc() {
  const [places, feature, index, known] = [[], [], [], new Map()];
  const vertex = (x, y, id) => {
    const key = `${x},${y},${id}`;
    if (!known.has(key)) {
      known.set(key, feature.length);
      places.push(x, y, 0);
      feature.push(id);
    }
    return known.get(key);
  };
  for (let x = 0; x < CELLS; x++) {
    for (let y = 0; y < CELLS; y++) {
      for (const corners of [[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]]) {
        const [cx, cy] = [0, 1].map((axis) => (axis ? y : x) + corners.reduce((sum, c) => sum + c[axis], 0) / 3);
        const pinhole = x === MIDDLE && y === MIDDLE;
        const scrap = x === 3 && y === 3;
        const id = scrap || (!pinhole && Math.hypot(cx - MIDDLE, cy - MIDDLE) < RADIUS) ? 1 : 0;
        index.push(...corners.map(([dx, dy]) => vertex(x + dx, y + dy, id)));
      }
    }
  }
  const arrays = { position: new Float32Array(places), feature: new Float32Array(feature), index: new Uint32Array(index) };
  return { ...arrays, places };
}

/** Distances from the middle at which `value` changes its sign along the triangles' edges. */
function crossings({ places, index }, value) {
  const found = [];
  for (let k = 0; k < index.length; k += 3) {
    for (let c = 0; c < 3; c++) {
      const [a, b] = [index[k + c], index[k + ((c + 1) % 3)]];
      if (value(a) > 0 === value(b) > 0) continue;
      const share = value(a) / (value(a) - value(b));
      const [x, y] = [0, 1].map((axis) => places[3 * a + axis] + share * (places[3 * b + axis] - places[3 * a + axis]));
      found.push(Math.hypot(x - MIDDLE, y - MIDDLE));
    }
  }
  return found;
}

test("a border is a smooth curve, without scraps and pinholes", () => {
  const mesh = disc();
  const { near, inside } = bordersOf(mesh);
  const smooth = crossings(mesh, (v) => inside[v]);
  assert.ok(smooth.length > 100, "there is no border");
  const off = smooth.map((radius) => Math.abs(radius - RADIUS));
  const mean = off.reduce((sum, value) => sum + value, 0) / off.length;
  // The triangles' own border lies up to a whole cell off, in steps.
  assert.ok(Math.max(...off) < 0.5, `the border lies up to ${Math.max(...off)} cells off the circle`);
  assert.ok(mean < 0.2, `the border lies ${mean} cells off the circle`);
  for (let v = 0; v < near.length; v++) {
    const from = Math.hypot(mesh.places[3 * v] - MIDDLE, mesh.places[3 * v + 1] - MIDDLE);
    if (from < RADIUS - 2) assert.ok(inside[v] > 0, `${from} cells from the middle is outside`);
    if (from > RADIUS + 2) assert.ok(inside[v] < 0, `${from} cells from the middle is inside`);
    if (mesh.feature[v] === 0 && Math.abs(from - RADIUS) < 1) assert.equal(near[v], 1);
  }
});
