/** The direction that a wall faces, so that the camera stays in front of it and above the mat. */

import { Box3, Vector3 } from "three";
import type { Tables } from "../data/types";

/** The parts of a wall that determine its framing. */
export interface FramingInput {
  surfaces: { position: Float32Array; index: Uint16Array | Uint32Array }[];
  tables: Tables;
  box: Box3;
}

export interface Framing {
  /** Horizontal unit vector from the wall to where climbers stand. */
  direction: Vector3;
  /** How far the view comes from above (positive) or, for overhanging walls, from below. */
  rise: number;
  /** Half of the allowed swing in radians; Infinity for a boulder that one walks around. */
  swing: number;
  /** Height of the mat. */
  floor: number;
  /** Box of the climbing surface: without far, flat floor. */
  box: Box3;
  /** Places that the picture of the whole wall must show. */
  places: Vector3[];
  /** Width by height of those places as seen from the framing. */
  aspect: number;
}

/** How far a wall that does not lean is looked at from above. */
export const RISE = 0.12;
/** Cosine from which a triangle lies level. */
const LEVEL = 0.95;
/** How far over the highest hold a wall may end, as a share of the height of its holds. */
const OVER = 0.5;
/** Share of the surface that must be level for there to be a mat. */
const MAT = 0.02;

/**
 * Height of the mat: the middle one of the level surface below the lowest hold. The lowest point
 * of the mesh would be some scrap far under it, and the camera would look through the mat.
 */
function matUnder(
  lowest: number,
  level: [height: number, area: number][],
  whole: number,
): number | undefined {
  const mat = level.filter(([height]) => height < lowest).sort((one, two) => one[0] - two[0]);
  const area = mat.reduce((sum, [, part]) => sum + part, 0);
  if (area < MAT * whole) return undefined;
  let sum = 0;
  return mat.find(([, part]) => (sum += part) >= area / 2)?.[0];
}

/** Area-weighted mean of the steep triangles' horizontal normals, from every n-th triangle. */
export function framingOf(wall: FramingInput): Framing {
  const sum = new Vector3();
  const [a, b, c] = [new Vector3(), new Vector3(), new Vector3()];
  let total = 0;
  let whole = 0;
  const steep = new Box3();
  const seen: Vector3[] = [];
  const level: [height: number, area: number][] = [];
  for (const { position, index } of wall.surfaces) {
    const step = 3 * Math.max(1, Math.floor(index.length / 3 / 40000));
    for (let k = 0; k + 2 < index.length; k += step) {
      a.fromArray(position, 3 * index[k]!);
      b.fromArray(position, 3 * index[k + 1]!).sub(a);
      c.fromArray(position, 3 * index[k + 2]!).sub(a);
      b.cross(c);
      const area = b.length();
      // Mats and table tops say nothing about where the wall faces.
      whole += area;
      if (b.z > LEVEL * area) level.push([a.z, area]);
      if (area === 0 || b.z > 0.8 * area) continue;
      steep.expandByPoint(a);
      seen.push(a.clone());
      sum.x += b.x;
      sum.y += b.y;
      sum.z += b.z;
      total += Math.hypot(b.x, b.y);
    }
  }
  // Evenly from all of them: the first ones alone would be one end of the wall.
  const every = Math.ceil(seen.length / 4000);
  const thinned = seen.filter((_, k) => k % every === 0);
  const holds = [...wall.tables.holds.values()];
  if (holds.length > 3) {
    // Holds say better than stray surface which way the wall faces.
    sum.set(0, 0, 0);
    total = 0;
    for (const { normal } of holds) {
      sum.add(a.set(...normal));
      total += Math.hypot(normal[0], normal[1]);
    }
  }
  const coherence = total > 0 ? Math.hypot(sum.x, sum.y) / total : 0;
  const rise = Math.min(0.3, Math.max(-0.6, RISE + (0.9 * sum.z) / Math.max(total, 1e-9)));
  const direction = coherence > 0.02 ? sum.setZ(0).normalize() : new Vector3(0, -1, 0);
  const swing = coherence > 0.4 ? (75 * Math.PI) / 180 : Infinity;
  const box = holds.length > 3 ? new Box3() : steep.isEmpty() ? wall.box.clone() : steep;
  for (const hold of holds.length > 3 ? holds : []) {
    box.expandByPoint(new Vector3(...hold.position));
  }
  if (holds.length > 3) {
    const size = box.getSize(new Vector3());
    box.expandByScalar(0.06 * Math.max(size.x, size.y, size.z));
    box.min.z = Math.max(box.min.z, wall.box.min.z);
    box.max.min(wall.box.max);
  }
  const places = placesOf(wall, box, thinned, direction);
  const lowest = holds.length > 3 ? Math.min(...holds.map((hold) => hold.position[2])) : box.max.z;
  const floor = matUnder(lowest, level, whole) ?? wall.box.min.z;
  return { direction, rise, swing, floor, box, places, aspect: aspectOf(places, direction) };
}

function aspectOf(places: Vector3[], direction: Vector3): number {
  const right = new Vector3(0, 0, 1).cross(direction);
  const box = new Box3();
  for (const place of places) box.expandByPoint(new Vector3(place.dot(right), 0, place.z));
  const size = box.getSize(new Vector3());
  return Math.min(20, Math.max(0.05, size.x / Math.max(size.z, 1e-9)));
}

/**
 * The places that a picture of the whole wall must show: the holds with room around, their wall up to
 * its upper edge, and down to the mat.
 */
function placesOf(wall: FramingInput, box: Box3, seen: Vector3[], direction: Vector3): Vector3[] {
  const holds = [...wall.tables.holds.values()];
  if (holds.length <= 3) return seen;
  const size = box.getSize(new Vector3());
  const most = Math.max(size.x, size.y, size.z);
  const room = 0.04 * most;
  const mat = Math.max(wall.box.min.z, box.min.z - 0.3);
  const held = holds.flatMap(({ position: [x, y, z] }) => [
    new Vector3(x - room, y - room, z),
    new Vector3(x + room, y + room, Math.min(z + 2 * room, wall.box.max.z)),
    new Vector3(x, y, mat),
  ]);
  // Beside and behind the holds stand other walls; over them is more of this one.
  const right = new Vector3(0, 0, 1).cross(direction);
  const turned = (place: Vector3): Vector3 => new Vector3(place.dot(right), place.dot(direction), place.z);
  const near = new Box3().setFromPoints(holds.map(({ position }) => turned(new Vector3(...position))));
  near.expandByVector(new Vector3(0.15 * most, 0.25 * most, 0));
  near.min.z = mat;
  near.max.z += OVER * (near.max.z - box.min.z);
  const around = seen.filter((place) => near.containsPoint(turned(place)));
  // A scrap of surface in the air is no edge.
  around.sort((one, two) => one.z - two.z);
  return [...held, ...around.slice(0, Math.ceil(0.997 * around.length))];
}

/** A framing that came from the worker: what was a vector there is one again. */
export function restoredFraming(framing: Framing): Framing {
  const vector = (plain: Vector3): Vector3 => new Vector3().copy(plain);
  const box = new Box3(vector(framing.box.min), vector(framing.box.max));
  return { ...framing, direction: vector(framing.direction), box, places: framing.places.map(vector) };
}
