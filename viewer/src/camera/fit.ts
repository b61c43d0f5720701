/** The camera position from which places fill the free part of the canvas. */

import { Box2, Box3, Vector2, Vector3 } from "three";

/** CSS pixels at each side of the canvas that something else covers. */
export interface Insets {
  top: number;
  right: number;
  bottom: number;
  left: number;
}

export interface Lens {
  /** CSS pixels of the canvas. */
  width: number;
  height: number;
  /** Tangent of half the vertical field of view. */
  tan: number;
  /** The camera comes no nearer. */
  least: number;
}

/** The free part of a canvas, in -1..1 from its left bottom. */
export function freeBox(insets: Insets, width: number, height: number): Box2 {
  return new Box2(
    new Vector2((2 * insets.left) / width - 1, (2 * insets.bottom) / height - 1),
    new Vector2(1 - (2 * insets.right) / width, 1 - (2 * insets.top) / height),
  );
}

/** Places and the found target are along right, up and towards the camera. */
function fit(places: Vector3[], insets: Insets, lens: Lens): { x: number; y: number; z: number; distance: number } {
  const free = freeBox(insets, lens.width, lens.height);
  const room = free.getSize(new Vector2()).max(new Vector2(0.1, 0.1));
  const aim = free.getCenter(new Vector2());
  const box = new Box3().setFromPoints(places);
  const { x, y, z } = box.getCenter(new Vector3());
  const found = { x, y, z, distance: box.getSize(new Vector3()).length() + lens.least };
  const wide = (lens.tan * lens.width) / lens.height;
  const drawn = new Box2();
  // Perspective makes the exact answer an equation; a few steps from near it settle it.
  for (let step = 0; step < 8; step++) {
    drawn.makeEmpty();
    for (const place of places) {
      const ahead = Math.max(1e-6, found.distance - (place.z - found.z));
      const across = (place.x - found.x) / (ahead * wide);
      drawn.expandByPoint(new Vector2(across, (place.y - found.y) / (ahead * lens.tan)));
    }
    const size = drawn.getSize(new Vector2());
    const middle = drawn.getCenter(new Vector2());
    const grow = Math.max(size.x / room.x, size.y / room.y, 1e-3);
    found.distance = Math.max(lens.least, found.distance * grow);
    found.x += (middle.x - aim.x) * wide * found.distance;
    found.y += (middle.y - aim.y) * lens.tan * found.distance;
  }
  return found;
}

/** Eye and target of a look along -`way` that shows places as large as they fit. */
export function fitPlaces(places: Vector3[], way: Vector3, insets: Insets, lens: Lens): { eye: Vector3; target: Vector3 } {
  const right = new Vector3(0, 0, 1).cross(way).normalize();
  const up = way.clone().cross(right);
  const flat = places.map((p) => new Vector3(p.dot(right), p.dot(up), p.dot(way)));
  const found = fit(flat, insets, lens);
  const target = new Vector3()
    .addScaledVector(right, found.x)
    .addScaledVector(up, found.y)
    .addScaledVector(way, found.z);
  return { eye: target.clone().addScaledVector(way, found.distance), target };
}
