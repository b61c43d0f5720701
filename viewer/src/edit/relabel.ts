/** Triangles of a tier given to other holds, where edits changed whose surface is whose. */

import { BufferAttribute } from "three";
import type { BufferGeometry } from "three";
import type { Region } from "./result";

const REACH = 4; // mean distances of neighbouring triangles that a tier's surface may lie off the mesh's

/** As the tier came. */
interface Original {
  index: Uint16Array | Uint32Array;
  feature: Float32Array;
}

/** The triangles of all regions, found by place. */
class Lookup {
  private readonly cells = new Map<number, number[]>();
  private readonly size: number;

  constructor(private readonly regions: Region[]) {
    const spacing = regions.map(({ radius, labels }) => radius * Math.sqrt(Math.PI / Math.max(labels.length, 1)));
    this.size = Math.max(1e-6, Math.min(REACH * Math.max(...spacing), Math.max(...regions.map(({ radius }) => radius))));
    regions.forEach(({ centroids }, region) => {
      for (let k = 0; k < centroids.length; k += 3) {
        const cell = this.key(centroids[k]!, centroids[k + 1]!, centroids[k + 2]!, 0, 0, 0);
        const others = this.cells.get(cell);
        if (others) others.push(region, k);
        else this.cells.set(cell, [region, k]);
      }
    });
  }

  private key(x: number, y: number, z: number, dx: number, dy: number, dz: number): number {
    const [a, b, c] = [x, y, z].map((v) => Math.floor(v / this.size)) as [number, number, number];
    return ((a + dx) * 2 ** 17 + (b + dy)) * 2 ** 17 + (c + dz);
  }

  /** The label of the nearest triangle; null where none is near, or the place lies in no region. */
  label(x: number, y: number, z: number): number | null {
    const within = this.regions.some(({ at, radius }) => (x - at[0]) ** 2 + (y - at[1]) ** 2 + (z - at[2]) ** 2 <= radius * radius);
    if (!within) return null;
    let least = this.size * this.size;
    let found: number | null = null;
    for (let cell = 0; cell < 27; cell++) {
      const inside = this.cells.get(this.key(x, y, z, (cell % 3) - 1, (Math.floor(cell / 3) % 3) - 1, Math.floor(cell / 9) - 1));
      for (let n = 0; inside && n < inside.length; n += 2) {
        const { centroids, labels } = this.regions[inside[n]!]!;
        const k = inside[n + 1]!;
        const square = (x - centroids[k]!) ** 2 + (y - centroids[k + 1]!) ** 2 + (z - centroids[k + 2]!) ** 2;
        if (square > least) continue;
        least = square;
        found = labels[k / 3]!;
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
    const known = new Map<string, number>();
    for (let k = 0; given && k < index.length; k += 3) {
      const [a, b, c] = [3 * index[k]!, 3 * index[k + 1]!, 3 * index[k + 2]!];
      const middle = (axis: number): number => (places[a + axis]! + places[b + axis]! + places[c + axis]!) / 3;
      const label = given.label(middle(0), middle(1), middle(2));
      if (label === null || label === feature[index[k]!]) continue;
      // Vertices are never shared over a border: the triangle gets some of its own.
      for (let corner = k; corner < k + 3; corner++) {
        const from = index[corner]!;
        const key = `${from} ${label}`;
        let own = known.get(key);
        if (own === undefined) {
          own = count + copied.length;
          known.set(key, own);
          copied.push(from);
          labels.push(label);
        }
        corners[corner] = own;
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
