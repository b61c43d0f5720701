/**
 * Borders of holds, finer than triangles: for each vertex near a border, how far inside the hold's smooth
 * border curve it lies. Between vertices the GPU interpolates, so that colour and outline end on the
 * curve and not on the triangles' edges. Scraps of a hold apart from it count as wall, pinholes in it
 * as hold. Picking and the tables keep the triangles.
 */

import type { TriangleMesh } from "../tiers/surface";
import { inside, loopLength, smoothCurve } from "./smooth_curve";
import type { Curve } from "./smooth_curve";
import { weldVertices } from "./weld_vertices";
import type { WeldedVertices } from "./weld_vertices";

const SCRAP = 0.12; // of the hold's largest piece by surface: less is no part of it
const PINHOLE = 0.3; // of the hold's outer border by length: less is no hole
const RINGS = 3; // triangles on each side of a border that its curve may cross

export interface Borders {
  /** The hold whose border is near each vertex. */
  near: Float32Array;
  /** How far inside that hold each vertex lies; negative outside. */
  inside: Float32Array;
}

type Ids = Int32Array<ArrayBuffer>;

type Welded = TriangleMesh & WeldedVertices;

/** Triangles of each hold; those of the wall under 0. */
function grouped({ index, feature }: Welded): Map<number, number[]> {
  const groups = new Map<number, number[]>();
  for (let k = 0; k < index.length; k += 3) {
    const id = feature[index[k]!]!;
    const group = groups.get(id);
    if (group) group.push(k);
    else groups.set(id, [k]);
  }
  return groups;
}

const centre = (mesh: Welded, k: number, axis: number): number =>
  (mesh.position[3 * mesh.index[k]! + axis]! +
    mesh.position[3 * mesh.index[k + 1]! + axis]! +
    mesh.position[3 * mesh.index[k + 2]! + axis]!) /
  3;

function area({ position, index }: Welded, k: number): number {
  const [a, b, c] = [3 * index[k]!, 3 * index[k + 1]!, 3 * index[k + 2]!];
  const u = [0, 1, 2].map((i) => position[b + i]! - position[a + i]!) as [number, number, number];
  const v = [0, 1, 2].map((i) => position[c + i]! - position[a + i]!) as [number, number, number];
  return Math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

/** Loops of places around some triangles, the triangles on their left. */
function loopsOf({ index, weld }: Welded, triangles: number[]): number[][] {
  const many = 2 ** 26;
  const edges = new Set<number>();
  for (const k of triangles) {
    for (let c = 0; c < 3; c++) edges.add(weld[index[k + c]!]! * many + weld[index[k + ((c + 1) % 3)]!]!);
  }
  const ways = new Map<number, number[]>();
  for (const edge of edges) {
    const [from, to] = [Math.floor(edge / many), edge % many];
    if (from === to || edges.has(to * many + from)) continue;
    const others = ways.get(from);
    if (others) others.push(to);
    else ways.set(from, [to]);
  }
  const loops: number[][] = [];
  for (const start of ways.keys()) {
    for (;;) {
      const loop: number[] = [];
      let at = start;
      for (let to = ways.get(at)!.pop(); to !== undefined; to = ways.get(at)?.pop()) {
        loop.push(at);
        at = to;
        if (at === start) break;
      }
      if (loop.length === 0) break;
      if (at === start && loop.length > 2) loops.push(loop);
    }
  }
  return loops;
}

/** The pieces of a hold that touch each other, each with its surface. */
function piecesOf(mesh: Welded, triangles: number[]): { triangles: number[]; area: number }[] {
  const { index, weld } = mesh;
  const parent = new Map<number, number>();
  const root = (place: number): number => {
    let at = place;
    for (let up = parent.get(at) ?? at; up !== at; up = parent.get(at) ?? at) {
      parent.set(at, parent.get(up) ?? up);
      at = up;
    }
    return at;
  };
  for (const k of triangles) {
    const first = root(weld[index[k]!]!);
    for (let c = 1; c < 3; c++) parent.set(root(weld[index[k + c]!]!), first);
    parent.set(first, first);
  }
  const pieces = new Map<number, { triangles: number[]; area: number }>();
  for (const k of triangles) {
    const key = root(weld[index[k]!]!);
    const piece = pieces.get(key) ?? { triangles: [], area: 0 };
    piece.triangles.push(k);
    piece.area += area(mesh, k);
    pieces.set(key, piece);
  }
  return [...pieces.values()];
}

class Shaper {
  private readonly found: Borders;
  private readonly curves = new Map<number, Curve[]>();
  /** The hold that owns each place on or near a border; -1 elsewhere. */
  private readonly owner: Ids;
  /** Places that count as inside their owner whatever its curve says. */
  private readonly filled = new Set<number>();
  /** Triangles at each place where two ids meet. */
  private readonly around = new Map<number, number[]>();

  constructor(private readonly mesh: Welded) {
    const count = mesh.weld.length;
    this.found = { near: new Float32Array(count), inside: new Float32Array(count) };
    this.owner = new Int32Array(mesh.vertex.length).fill(-1);
  }

  run(): Borders {
    const { feature } = this.mesh;
    const { near, inside: depth } = this.found;
    let most = 0;
    for (let k = 0; k < this.mesh.position.length; k++) most = Math.max(most, Math.abs(this.mesh.position[k]!));
    for (let v = 0; v < near.length; v++) {
      near[v] = feature[v]!;
      depth[v] = feature[v]! > 0 ? most : -most;
    }
    const groups = grouped(this.mesh);
    this.meet();
    for (const [id, triangles] of groups) {
      if (id === 0) continue;
      this.hold(id, triangles, most);
    }
    this.wall(groups.get(0) ?? [], most);
    return this.found;
  }

  /** Collect the triangles around the places where two ids meet. */
  private meet(): void {
    const { index, feature, weld } = this.mesh;
    const first = new Int32Array(this.owner.length).fill(-1);
    const mixed = new Uint8Array(this.owner.length);
    for (let k = 0; k < index.length; k++) {
      const [place, id] = [weld[index[k]!]!, feature[index[k]!]!];
      if (first[place]! < 0) first[place] = id;
      else if (first[place] !== id) mixed[place] = 1;
    }
    for (let k = 0; k < index.length; k++) {
      const place = weld[index[k]!]!;
      if (!mixed[place]) continue;
      const triangles = this.around.get(place);
      if (triangles) triangles.push(k - (k % 3));
      else this.around.set(place, [k - (k % 3)]);
    }
  }

  private hold(id: number, triangles: number[], most: number): void {
    const pieces = piecesOf(this.mesh, triangles);
    const largest = Math.max(...pieces.map((piece) => piece.area));
    const curves: Curve[] = [];
    const kept: number[] = [];
    const seeds: number[] = [];
    for (const piece of pieces) {
      if (piece.area < SCRAP * largest) {
        this.mark(piece.triangles, -most);
        continue;
      }
      kept.push(...piece.triangles);
      const loops = loopsOf(this.mesh, piece.triangles).map((loop) => ({ loop, places: this.placesOf(loop) }));
      const outer = Math.max(0, ...loops.map(({ places }) => loopLength(places)));
      for (const { loop, places } of loops) {
        const pinhole = loopLength(places) < PINHOLE * outer;
        for (const place of loop) {
          if (pinhole) this.filled.add(place);
          this.owner[place] = id;
        }
        if (pinhole) continue;
        seeds.push(...loop);
        curves.push(smoothCurve(places, this.outwardOf(loop, id)));
      }
    }
    if (curves.length === 0) return;
    this.curves.set(id, curves);
    this.inner(id, kept, new Set(seeds));
  }

  private mark(triangles: number[], depth: number): void {
    for (const k of triangles) for (let c = 0; c < 3; c++) this.found.inside[this.mesh.index[k + c]!] = depth;
  }

  private placesOf(loop: number[]): Float64Array {
    const { position, vertex } = this.mesh;
    return Float64Array.from({ length: 3 * loop.length }, (_, k) => {
      return position[3 * vertex[loop[Math.floor(k / 3)]!]! + (k % 3)]!;
    });
  }

  /** From the hold's triangles at each place to the others there, of length one. */
  private outwardOf(loop: number[], id: number): Float64Array {
    const found = new Float64Array(3 * loop.length);
    loop.forEach((place, at) => {
      const sums = [0, 0, 0];
      for (let axis = 0; axis < 3; axis++) {
        const own: number[] = [];
        const others: number[] = [];
        for (const k of this.around.get(place) ?? []) {
          (this.mesh.feature[this.mesh.index[k]!] === id ? own : others).push(centre(this.mesh, k, axis));
        }
        const here = this.mesh.position[3 * this.mesh.vertex[place]! + axis]!;
        const mean = (values: number[]): number =>
          values.length ? values.reduce((sum, value) => sum + value, 0) / values.length - here : 0;
        sums[axis] = mean(others) - mean(own);
      }
      const length = Math.hypot(...sums) || 1;
      for (let axis = 0; axis < 3; axis++) found[3 * at + axis] = sums[axis]! / length;
    });
    return found;
  }

  /** How far inside the hold's own vertices near its border lie. */
  private inner(id: number, triangles: number[], reached: Set<number>): void {
    const { index, weld } = this.mesh;
    for (let ring = 0; ring < RINGS; ring++) {
      const next: number[] = [];
      for (const k of triangles) {
        const places = [0, 1, 2].map((c) => weld[index[k + c]!]!);
        if (places.some((place) => reached.has(place))) next.push(...places);
      }
      for (const place of next) reached.add(place);
    }
    for (const k of triangles) {
      for (let c = 0; c < 3; c++) {
        const v = index[k + c]!;
        if (reached.has(weld[v]!)) this.found.inside[v] = this.depth(id, v);
      }
    }
  }

  private depth(id: number, v: number): number {
    const { position } = this.mesh;
    return inside(this.curves.get(id)!, position[3 * v]!, position[3 * v + 1]!, position[3 * v + 2]!);
  }

  /** The wall's vertices near a border: whose, and how far outside. */
  private wall(triangles: number[], most: number): void {
    const { index, weld } = this.mesh;
    const { near, inside: depth } = this.found;
    for (let ring = 0; ring < RINGS; ring++) {
      const claims: [place: number, id: number, filled: boolean][] = [];
      for (let t = 0; t < triangles.length; t++) {
        const k = triangles[t]!;
        const places = [weld[index[k]!]!, weld[index[k + 1]!]!, weld[index[k + 2]!]!];
        const from = places.find((place) => this.owner[place]! >= 0);
        if (from === undefined) continue;
        for (const place of places) {
          if (this.owner[place]! < 0) claims.push([place, this.owner[from]!, this.filled.has(from)]);
        }
      }
      for (const [place, id, filled] of claims) {
        if (this.owner[place]! >= 0) continue;
        this.owner[place] = id;
        if (filled) this.filled.add(place);
      }
    }
    for (let t = 0; t < triangles.length; t++) {
      for (let c = 0; c < 3; c++) {
        const v = index[triangles[t]! + c]!;
        const place = weld[v]!;
        const id = this.owner[place]!;
        if (id < 0 || near[v] === id || !this.curves.has(id)) continue;
        near[v] = id;
        depth[v] = this.filled.has(place) ? most : this.depth(id, v);
      }
    }
  }
}

export function bordersOf(mesh: TriangleMesh): Borders {
  return new Shaper({ ...mesh, ...weldVertices(mesh.position) }).run();
}
