// What must hold where labels meet a tier: on a sheet of large triangles, of which an edit gave a disc to a hold.

import assert from "node:assert/strict";
import { test } from "vitest";
import { extended, labelled, Labels } from "../../src/geometry/labels";

const CELLS = 4; // squares of the tier along a side
const FINE = 40; // squares of the mesh along a side
const MIDDLE = [2.1, 1.9];
const RADIUS = 0.7;

/** A flat sheet of squares, each two triangles; the vertices of every square are its own where `apart`. */
function sheet(cells, apart = false) {
  const [position, index] = [[], []];
  const known = new Map();
  const vertex = (x, y, square) => {
    const key = `${x},${y},${apart ? square : ""}`;
    if (!known.has(key)) {
      known.set(key, position.length / 3);
      position.push((x / cells) * CELLS, (y / cells) * CELLS, 0);
    }
    return known.get(key);
  };
  for (let x = 0; x < cells; x++) {
    for (let y = 0; y < cells; y++) {
      const corner = (dx, dy) => vertex(x + dx, y + dy, `${x},${y}`);
      index.push(corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 0), corner(1, 1), corner(0, 1));
    }
  }
  return { position: new Float32Array(position), index: new Uint32Array(index), patch: new Float32Array(position.length / 3) };
}

const centre = ({ position, index }, k) => [0, 1, 2].map((axis) => [0, 1, 2].reduce((sum, c) => sum + position[3 * index[k + c] + axis] / 3, 0));

const inDisc = ([x, y]) => Math.hypot(x - MIDDLE[0], y - MIDDLE[1]) < RADIUS;

/** What the server would say of the disc, which belongs to hold 7 now: the mesh's own triangles, and those around. */
function surface() {
  const mesh = sheet(FINE);
  const step = CELLS / FINE / 16;
  const groups = [[], []];
  for (let k = 0; k < mesh.index.length; k += 3) {
    const place = centre(mesh, k);
    const from = Math.hypot(place[0] - MIDDLE[0], place[1] - MIDDLE[1]);
    if (from < RADIUS) groups[0].push(place);
    else if (from < RADIUS + CELLS / FINE) groups[1].push(place);
  }
  const coded = (places) => {
    let before = [0, 0, 0];
    return places.flatMap((place) => {
      const at = place.map((value) => Math.round(value / step));
      const steps = at.map((value, axis) => value - before[axis]);
      before = at;
      return steps;
    });
  };
  const [changed, unchanged] = groups.map(coded);
  return { patches: [], changed: [{ label: 7, places: changed }], unchanged, origin: [0, 0, 0], step, edge: CELLS / FINE };
}

function joined(tier, raw = surface()) {
  const found = labelled(tier, new Labels(raw));
  const position = extended(tier.position, 3, tier.patch.length, found.parents);
  return { ...found, position };
}

function area({ position, index }, k) {
  const [a, b, c] = [0, 1, 2].map((corner) => position.subarray(3 * index[k + corner], 3 * index[k + corner] + 3));
  return Math.abs((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2;
}

/** Sum of the triangles' areas, of those with a label or of all. */
function areaOf(net, label) {
  let sum = 0;
  for (let k = 0; k < net.index.length; k += 3) if (label === undefined || net.feature[net.index[k]] === label) sum += area(net, k);
  return sum;
}

/** Edges, by place, that one triangle alone has, as a length. */
function rim({ position, index }) {
  const place = (vertex) => `${position[3 * vertex]},${position[3 * vertex + 1]}`;
  const edges = new Map();
  for (let k = 0; k < index.length; k += 3) {
    for (let c = 0; c < 3; c++) {
      const [a, b] = [index[k + c], index[k + ((c + 1) % 3)]];
      const key = [place(a), place(b)].sort().join(" ");
      edges.set(key, [...(edges.get(key) ?? []), Math.hypot(position[3 * a] - position[3 * b], position[3 * a + 1] - position[3 * b + 1])]);
    }
  }
  return [...edges.values()].filter((lengths) => lengths.length === 1).reduce((sum, [length]) => sum + length, 0);
}

test("a hold whose border follows no edge of the tier is cut out of it", () => {
  for (const apart of [false, true]) {
    const net = joined(sheet(CELLS, apart));
    const wanted = Math.PI * RADIUS ** 2;
    assert.ok(Math.abs(areaOf(net, 7) - wanted) < 0.04 * wanted, `the hold has ${areaOf(net, 7)} of ${wanted}`);
    assert.ok(Math.abs(areaOf(net) - CELLS ** 2) < 1e-4, "surface came or went");
    for (let k = 0; k < net.index.length; k += 3) {
      const [a, b, c] = [0, 1, 2].map((corner) => net.feature[net.index[k + corner]]);
      assert.ok(a === b && b === c, "a triangle mixes two labels");
      if (a === 7) assert.ok(inDisc(centre(net, k).map((value, axis) => MIDDLE[axis] + 0.85 * (value - MIDDLE[axis]))), "the hold is too wide");
    }
    assert.ok(net.index.length < 3 * 2500, `${net.index.length / 3} triangles`);
  }
});

test("cutting a tier opens no crack", () => {
  for (const apart of [false, true]) {
    const net = joined(sheet(CELLS, apart));
    assert.ok(Math.abs(rim(net) - 4 * CELLS) < 1e-3, `edges of one triangle alone: ${rim(net)}, around the sheet ${4 * CELLS}`);
  }
});

test("a tier that no edit changed stays as it is", () => {
  const tier = sheet(CELLS);
  tier.patch.fill(3);
  const none = { patches: [[3, 5]], changed: [], unchanged: [], origin: [0, 0, 0], step: 1, edge: 1 };
  const net = joined(tier, none);
  assert.equal(net.index, tier.index);
  assert.deepEqual([...new Set(net.feature)], [5]);
});

test("a place has the label of the mesh there", () => {
  const found = new Labels(surface());
  for (let x = 0.05; x < CELLS; x += 0.1) {
    for (let y = 0.05; y < CELLS; y += 0.1) {
      const from = Math.hypot(x - MIDDLE[0], y - MIDDLE[1]);
      if (Math.abs(from - RADIUS) < CELLS / FINE) continue; // the border follows the mesh's triangles
      assert.equal(found.at(4, x, y, 0.02), from < RADIUS ? 7 : 4);
    }
  }
});
