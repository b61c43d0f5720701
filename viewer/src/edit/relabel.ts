/** Triangles of a tier given to other holds, where edits changed whose surface is whose. */

import { BufferAttribute } from "three";
import type { BufferGeometry } from "three";
import type { Region } from "./result";

const REACH = 4; // mean distances between triangles that a tier's surface may lie off the mesh's

/** As the tier came. */
interface Original {
  index: Uint16Array | Uint32Array;
  feature: Float32Array;
}

/** The triangles of all regions, found by place: a hash grid whose cells are as wide as triangles lie apart. */
class Lookup {
  private readonly places: Float32Array;
  private readonly labels: Int32Array;
  private readonly size: number;
  private readonly mask: number;
  /** Where each cell's triangles begin in `order`. */
  private readonly begin: Int32Array;
  private readonly order: Int32Array;

  constructor(private readonly regions: Region[]) {
    const count = regions.reduce((sum, { labels }) => sum + labels.length, 0);
    this.places = new Float32Array(3 * count);
    this.labels = new Int32Array(count);
    let at = 0;
    let area = 0;
    for (const { centroids, labels, radius } of regions) {
      this.places.set(centroids, 3 * at);
      this.labels.set(labels, at);
      at += labels.length;
      area += Math.PI * radius * radius;
    }
    this.size = Math.max(1e-6, Math.sqrt(area / Math.max(count, 1)));
    this.mask = 2 ** Math.ceil(Math.log2(count + 2)) - 1;
    this.begin = new Int32Array(this.mask + 2);
    this.order = new Int32Array(count);
    const cells = Int32Array.from({ length: count }, (_, k) => this.cellAt(3 * k));
    for (const cell of cells) this.begin[cell + 1]!++;
    for (let cell = 0; cell <= this.mask; cell++) this.begin[cell + 1]! += this.begin[cell]!;
    const next = this.begin.slice();
    cells.forEach((cell, k) => (this.order[next[cell]!++] = k));
  }

  private cellAt(k: number): number {
    const { places, size } = this;
    return this.hash(Math.floor(places[k]! / size), Math.floor(places[k + 1]! / size), Math.floor(places[k + 2]! / size));
  }

  private hash(a: number, b: number, c: number): number {
    const mixed = Math.imul(a, 73856093) ^ Math.imul(b, 19349663) ^ Math.imul(c, 83492791);
    return (mixed ^ (mixed >>> 15)) & this.mask;
  }

  /** The label of the nearest triangle; null where the place lies in no region, or none is near. */
  label(x: number, y: number, z: number): number | null {
    if (!this.regions.some(({ at: [a, b, c], radius }) => (x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2 <= radius * radius)) return null;
    for (let reach = 1; reach <= REACH; reach *= 2) {
      const found = this.nearest(x, y, z, reach);
      if (found >= 0) return this.labels[found]!;
    }
    return null;
  }

  /** The nearest within `reach` cells; -1: none is. */
  private nearest(x: number, y: number, z: number, reach: number): number {
    const { places, size, begin, order } = this;
    const [a, b, c] = [Math.floor(x / size), Math.floor(y / size), Math.floor(z / size)];
    let least = (reach * size) ** 2;
    let found = -1;
    for (let i = a - reach; i <= a + reach; i++) {
      for (let j = b - reach; j <= b + reach; j++) {
        for (let k = c - reach; k <= c + reach; k++) {
          const cell = this.hash(i, j, k);
          for (let n = begin[cell]!; n < begin[cell + 1]!; n++) {
            const p = 3 * order[n]!;
            const square = (x - places[p]!) ** 2 + (y - places[p + 1]!) ** 2 + (z - places[p + 2]!) ** 2;
            if (square > least) continue;
            least = square;
            found = order[n]!;
          }
        }
      }
    }
    return found;
  }
}

/** An attribute with copies of some of its vertices behind the first `count`. */
function extended(attribute: BufferAttribute, count: number, copied: number[]): BufferAttribute {
  const { array, itemSize, normalized } = attribute;
  const longer = new (array.constructor as new (length: number) => Float32Array)(itemSize * (count + copied.length));
  longer.set(array.subarray(0, itemSize * count) as Float32Array);
  copied.forEach((from, k) => {
    for (let c = 0; c < itemSize; c++) longer[itemSize * (count + k) + c] = array[itemSize * from + c]!;
  });
  return new BufferAttribute(longer, itemSize, normalized);
}

/** A geometry whose triangles can change hands; its surface stays. */
export class Relabelled {
  private readonly original: Original;
  private changed = false;

  constructor(private readonly geometry: BufferGeometry) {
    this.original = {
      index: geometry.getIndex()!.array as Uint32Array,
      feature: geometry.getAttribute("feature").array as Float32Array,
    };
  }

  /** The labels that the tier came with but in the regions. True where that changed anything. */
  apply(regions: Region[]): boolean {
    if (regions.length === 0 && !this.changed) return false;
    const { index, feature } = this.original;
    const count = feature.length;
    const given = regions.length === 0 ? null : new Lookup(regions);
    const places = this.geometry.getAttribute("position").array;
    const corners = count + index.length > 65535 ? new Uint32Array(index) : index.slice();
    const copied: number[] = [];
    const labels: number[] = [];
    const known = new Map<number, Map<number, number>>(); // by label, then by vertex
    for (let k = 0; given && k < index.length; k += 3) {
      const [a, b, c] = [3 * index[k]!, 3 * index[k + 1]!, 3 * index[k + 2]!];
      const label = given.label(
        (places[a]! + places[b]! + places[c]!) / 3,
        (places[a + 1]! + places[b + 1]! + places[c + 1]!) / 3,
        (places[a + 2]! + places[b + 2]! + places[c + 2]!) / 3,
      );
      if (label === null || label === feature[index[k]!]) continue;
      // Vertices are never shared over a border: the triangle gets some of its own.
      const own = known.get(label) ?? new Map<number, number>();
      known.set(label, own);
      for (let corner = k; corner < k + 3; corner++) {
        const from = index[corner]!;
        let copy = own.get(from);
        if (copy === undefined) {
          copy = count + copied.length;
          own.set(from, copy);
          copied.push(from);
          labels.push(label);
        }
        corners[corner] = copy;
      }
    }
    this.replace(count, corners, copied, labels);
    this.changed = regions.length > 0;
    return true;
  }

  private replace(count: number, corners: Uint16Array | Uint32Array, copied: number[], labels: number[]): void {
    const { geometry } = this;
    geometry.dispose(); // what of it the GPU holds; it gets all of it anew
    for (const name of Object.keys(geometry.attributes)) {
      const longer = extended(geometry.getAttribute(name) as BufferAttribute, count, copied);
      geometry.setAttribute(name, longer);
    }
    // Where a triangle changed hands its border is its edge, until the smooth one is found.
    labels.forEach((label, k) => {
      geometry.getAttribute("feature").setX(count + k, label);
      geometry.getAttribute("near").setX(count + k, label);
      geometry.getAttribute("depth").setX(count + k, label > 0 ? 1 : -1);
    });
    geometry.setIndex(new BufferAttribute(corners, 1));
  }
}
