/**
 * The hold at each place of the surface: a tier's patches, and the edits since the tier was made
 * (`walltopo.scans.page_labels`). A triangle of the tier that is larger than those of the edits is cut.
 */

import type { SurfaceLabels } from "../data/wire";
import { weldVertices } from "./weld_vertices";

const REACH = 4; // usual edges of the mesh that a tier's surface may lie off the mesh's
const AROUND = 1; // usual edges: triangles so near to a changed one are cut
const FINE = 1.5; // usual edges: triangles so small are not cut
const CELL = 2; // usual edges: width of a cell of the grid
const AS_PATCH = -1;

/** Centroids from the steps between them. */
function placesOf(steps: readonly number[], { origin, step }: SurfaceLabels): Float32Array {
  const places = new Float32Array(steps.length);
  const at = [0, 0, 0];
  for (let k = 0; k < steps.length; k++) {
    at[k % 3]! += steps[k]!;
    places[k] = origin[k % 3]! + at[k % 3]! * step;
  }
  return places;
}

/** Finds labels by place. Triangles of the mesh lie in a hash grid. */
export class Labels {
  private readonly ofPatch: Map<number, number>; // of those that are shown as another hold
  private readonly places: Float32Array;
  private readonly labels: Int32Array;
  private readonly size: number;
  private readonly mask: number;
  /** The index in `order` at which each cell's triangles begin. */
  private readonly begin: Int32Array;
  private readonly order: Int32Array;
  readonly edge: number;
  /** How many triangles differ from their patch; they come first. */
  readonly changed: number;

  constructor(surface: SurfaceLabels) {
    this.ofPatch = new Map(surface.patches);
    this.edge = surface.edge;
    const groups = [...surface.changed, { label: AS_PATCH, places: surface.unchanged }];
    const count = groups.reduce((sum, { places }) => sum + places.length / 3, 0);
    this.changed = count - surface.unchanged.length / 3;
    this.places = new Float32Array(3 * count);
    this.labels = new Int32Array(count);
    let at = 0;
    for (const { label, places } of groups) {
      this.places.set(placesOf(places, surface), 3 * at);
      this.labels.fill(label, at, (at += places.length / 3));
    }
    this.size = CELL * surface.edge;
    this.mask = 2 ** Math.ceil(Math.log2(count + 2)) - 1;
    this.begin = new Int32Array(this.mask + 2);
    this.order = new Int32Array(count);
    const cells = Int32Array.from({ length: count }, (_, k) => {
      const [x, y, z] = this.places.subarray(3 * k, 3 * k + 3) as unknown as [number, number, number];
      return this.cell(this.along(x), this.along(y), this.along(z));
    });
    for (const cell of cells) this.begin[cell + 1]!++;
    for (let cell = 0; cell <= this.mask; cell++) this.begin[cell + 1]! += this.begin[cell]!;
    const next = this.begin.slice();
    cells.forEach((cell, k) => (this.order[next[cell]!++] = k));
  }

  equals(other: Labels): boolean {
    const same = (one: ArrayLike<number>, two: ArrayLike<number>): boolean => {
      if (one.length !== two.length) return false;
      for (let k = 0; k < one.length; k++) if (one[k] !== two[k]) return false;
      return true;
    };
    return (
      same([...this.ofPatch].flat(), [...other.ofPatch].flat()) && same(this.labels, other.labels) && same(this.places, other.places)
    );
  }

  /** The label of a patch where no edit changed a part of it. */
  patch(patch: number): number {
    return this.ofPatch.get(patch) ?? patch;
  }

  /** The label of a place on a patch. */
  at(patch: number, x: number, y: number, z: number): number {
    for (let reach = 1; this.changed > 0 && CELL * reach <= REACH; reach *= 2) {
      const label = this.nearest(x, y, z, reach);
      if (label !== null) return label === AS_PATCH ? this.patch(patch) : label;
    }
    return this.patch(patch);
  }

  /** Whether a changed triangle's centroid lies in a box or next to it. */
  touches(low: readonly number[], high: readonly number[]): boolean {
    const room = AROUND * this.edge;
    const [a, b, c] = low.map((v) => v - room) as [number, number, number];
    const [d, e, f] = high.map((v) => v + room) as [number, number, number];
    for (let i = this.along(a); i <= this.along(d); i++) {
      for (let j = this.along(b); j <= this.along(e); j++) {
        for (let k = this.along(c); k <= this.along(f); k++) {
          const cell = this.cell(i, j, k);
          for (let n = this.begin[cell]!; n < this.begin[cell + 1]!; n++) {
            const row = this.order[n]!;
            if (row >= this.changed) continue;
            const [x, y, z] = [this.places[3 * row]!, this.places[3 * row + 1]!, this.places[3 * row + 2]!];
            if (x >= a && x <= d && y >= b && y <= e && z >= c && z <= f) return true;
          }
        }
      }
    }
    return false;
  }

  private along(v: number): number {
    return Math.floor(v / this.size);
  }

  private cell(a: number, b: number, c: number): number {
    const mixed = Math.imul(a, 73856093) ^ Math.imul(b, 19349663) ^ Math.imul(c, 83492791);
    return (mixed ^ (mixed >>> 15)) & this.mask;
  }

  /** The label of the nearest triangle within `reach` cells; null: none is near. */
  private nearest(x: number, y: number, z: number, reach: number): number | null {
    const { places, begin, order } = this;
    const [a, b, c] = [this.along(x), this.along(y), this.along(z)];
    let least = (reach * this.size) ** 2;
    let found: number | null = null;
    for (let i = a - reach; i <= a + reach; i++) {
      for (let j = b - reach; j <= b + reach; j++) {
        for (let k = c - reach; k <= c + reach; k++) {
          const cell = this.cell(i, j, k);
          for (let n = begin[cell]!; n < begin[cell + 1]!; n++) {
            const p = 3 * order[n]!;
            const square = (x - places[p]!) ** 2 + (y - places[p + 1]!) ** 2 + (z - places[p + 2]!) ** 2;
            if (square > least) continue;
            least = square;
            found = this.labels[order[n]!]!;
          }
        }
      }
    }
    return found;
  }
}

/** A tier as its file has it. */
export interface Patches {
  /** Three of each vertex; there may be more, behind. */
  position: Float32Array;
  index: Uint16Array | Uint32Array;
  /** Patch of each vertex; no triangle has two. */
  patch: Float32Array;
}

/** A tier with labels. */
export interface Labelled {
  index: Uint16Array | Uint32Array;
  /** Label of each vertex, the added ones behind; no triangle has two. */
  feature: Float32Array;
  /** Two vertices of each added one, which lies in the middle between them. */
  parents: number[];
}

type Triangle = [a: number, b: number, c: number];

/** Join a tier and labels. */
export function labelled(tier: Patches, labels: Labels): Labelled {
  const feature = tier.patch.map((patch) => labels.patch(patch));
  if (labels.changed === 0) return { index: tier.index, feature, parents: [] };
  return new Cutter(tier, labels, feature).run();
}

class Cutter {
  private readonly count: number;
  /** Number of each vertex's place. */
  private readonly weld: Int32Array;
  // Vertices in the middle of an edge: coordinates, number of the place, patch.
  private readonly places: number[] = [];
  private readonly placed: number[] = [];
  private readonly patches: number[] = [];
  private readonly parents: number[] = [];
  private readonly middlePlaces = new Map<number, number>(); // by the two places beside
  private readonly middles = new Map<number, number>(); // by the two vertices beside
  private nextPlace: number;

  constructor(
    private readonly tier: Patches,
    private readonly labels: Labels,
    private readonly feature: Float32Array,
  ) {
    this.count = tier.patch.length;
    const { weld, vertex } = weldVertices(tier.position.subarray(0, 3 * this.count));
    this.weld = weld;
    this.nextPlace = vertex.length;
  }

  run(): Labelled {
    const { kept, near, beside } = this.parts();
    const [cut, others] = this.refine(near, beside);
    return this.give(kept, others, cut);
  }

  /** Triangles that may touch a change, those that have an edge with one, and the rest. */
  private parts(): { kept: number[]; near: Triangle[]; beside: Triangle[] } {
    const { index } = this.tier;
    const marked = new Uint8Array(this.nextPlace);
    const isNear = new Uint8Array(index.length / 3);
    for (let k = 0; k < index.length; k += 3) {
      const triangle: Triangle = [index[k]!, index[k + 1]!, index[k + 2]!];
      if (!this.isNear(triangle)) continue;
      isNear[k / 3] = 1;
      for (const vertex of triangle) marked[this.weld[vertex]!] = 1;
    }
    const kept: number[] = [];
    const near: Triangle[] = [];
    const beside: Triangle[] = [];
    for (let k = 0; k < index.length; k += 3) {
      const triangle: Triangle = [index[k]!, index[k + 1]!, index[k + 2]!];
      if (isNear[k / 3]) near.push(triangle);
      else if (triangle.reduce((sum, vertex) => sum + marked[this.weld[vertex]!]!, 0) > 1) beside.push(triangle);
      else kept.push(...triangle);
    }
    return { kept, near, beside };
  }

  private at(vertex: number, axis: number): number {
    return vertex < this.count ? this.tier.position[3 * vertex + axis]! : this.places[3 * (vertex - this.count) + axis]!;
  }

  private placeOf(vertex: number): number {
    return vertex < this.count ? this.weld[vertex]! : this.placed[vertex - this.count]!;
  }

  private patchOf(vertex: number): number {
    return vertex < this.count ? this.tier.patch[vertex]! : this.patches[vertex - this.count]!;
  }

  private isNear(triangle: Triangle): boolean {
    const low: number[] = [];
    const high: number[] = [];
    for (let axis = 0; axis < 3; axis++) {
      const [a, b, c] = [this.at(triangle[0], axis), this.at(triangle[1], axis), this.at(triangle[2], axis)];
      low.push(Math.min(a, b, c));
      high.push(Math.max(a, b, c));
    }
    return this.labels.touches(low, high);
  }

  private edgeOf(a: number, b: number): number {
    const [p, q] = [this.placeOf(a), this.placeOf(b)];
    return Math.min(p, q) * MANY + Math.max(p, q);
  }

  /**
   * Halve the long edges of triangles near a change, again and again. An edge is halved in all its triangles alike, also
   * where the vertices at one place are several: so no crack opens.
   */
  private refine(near: Triangle[], beside: Triangle[]): [near: Triangle[], beside: Triangle[]] {
    for (;;) {
      const halve = new Set<number>();
      for (const triangle of near) {
        if (!this.isNear(triangle)) continue;
        triangle.forEach((a, k) => {
          const b = triangle[(k + 1) % 3]!;
          if (this.length(a, b) > FINE * this.labels.edge) halve.add(this.edgeOf(a, b));
        });
      }
      if (halve.size === 0) return [near, beside];
      near = near.flatMap((triangle) => this.halved(triangle, halve));
      beside = beside.flatMap((triangle) => this.halved(triangle, halve));
    }
  }

  private length(a: number, b: number): number {
    return Math.hypot(this.at(a, 0) - this.at(b, 0), this.at(a, 1) - this.at(b, 1), this.at(a, 2) - this.at(b, 2));
  }

  private halved(triangle: Triangle, halve: Set<number>): Triangle[] {
    const middle = triangle.map((a, k) => {
      const b = triangle[(k + 1) % 3]!;
      return halve.has(this.edgeOf(a, b)) ? this.middle(a, b) : -1;
    });
    const count = middle.filter((vertex) => vertex >= 0).length;
    if (count === 0) return [triangle];
    // Turned so that one new vertex lies on the first edge, two on the first and second.
    const first = count === 1 ? middle.findIndex((vertex) => vertex >= 0) : middle.findIndex((vertex) => vertex < 0) + 1;
    const [u, v, w] = [0, 1, 2].map((k) => triangle[(first + k) % 3]!) as Triangle;
    const [p, q, r] = [0, 1, 2].map((k) => middle[(first + k) % 3]!) as Triangle;
    if (count === 1) return [[u, p, w], [p, v, w]];
    if (count === 2) return [[p, v, q], [u, p, q], [u, q, w]];
    return [[p, v, q], [u, p, r], [q, w, r], [p, q, r]];
  }

  private middle(a: number, b: number): number {
    const key = Math.min(a, b) * MANY + Math.max(a, b);
    const known = this.middles.get(key);
    if (known !== undefined) return known;
    const edge = this.edgeOf(a, b);
    let place = this.middlePlaces.get(edge);
    if (place === undefined) this.middlePlaces.set(edge, (place = this.nextPlace++));
    const vertex = this.count + this.patches.length;
    for (let axis = 0; axis < 3; axis++) this.places.push((this.at(a, axis) + this.at(b, axis)) / 2);
    this.placed.push(place);
    this.patches.push(this.patchOf(a));
    this.parents.push(a, b);
    this.middles.set(key, vertex);
    return vertex;
  }

  /** Vertices are never shared over a border: a triangle that changed hands gets some of its own. */
  private give(kept: number[], others: Triangle[], cut: Triangle[]): Labelled {
    const added = this.patches.map((patch) => this.labels.patch(patch));
    const corners = kept;
    for (const triangle of others) corners.push(...triangle);
    const copies = new Map<number, number>();
    for (const triangle of cut) {
      const [x, y, z] = [0, 1, 2].map((axis) => triangle.reduce((sum, vertex) => sum + this.at(vertex, axis), 0) / 3) as Triangle;
      const patch = this.patchOf(triangle[0]);
      const label = this.labels.at(patch, x, y, z);
      if (label === this.labels.patch(patch)) {
        corners.push(...triangle);
        continue;
      }
      for (const vertex of triangle) {
        const key = vertex * MANY + label;
        let copy = copies.get(key);
        if (copy === undefined) {
          copies.set(key, (copy = this.count + added.length));
          added.push(label);
          this.parents.push(vertex, vertex);
        }
        corners.push(copy);
      }
    }
    const feature = new Float32Array(this.count + added.length);
    feature.set(this.feature);
    feature.set(added, this.count);
    const index = feature.length > 65535 ? Uint32Array.from(corners) : Uint16Array.from(corners);
    return { index, feature, parents: this.parents };
  }
}

const MANY = 2 ** 26; // more than there are vertices or ids

type Numbers = Float32Array | Int8Array | Uint8Array | Int16Array | Uint16Array;

/** Numbers of vertices, with those of added vertices behind the first `count`. */
export function extended<T extends Numbers>(array: T, size: number, count: number, parents: readonly number[]): T {
  const longer = new (array.constructor as new (length: number) => T)(size * (count + parents.length / 2));
  longer.set(array.subarray(0, size * count));
  for (let k = 0; k < parents.length; k += 2) {
    const [a, b] = [size * parents[k]!, size * parents[k + 1]!];
    for (let c = 0; c < size; c++) longer[size * (count + k / 2) + c] = (longer[a + c]! + longer[b + c]!) / 2;
  }
  return longer;
}
