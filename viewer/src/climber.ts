/** Where a climber stands and looks, so that all of a route is in the free part of the picture. */

import type { Box2 } from "three";

/** A place as seen from the start: metres towards the climber, to the right, over the eyes. */
export interface Sight {
  out: number;
  side: number;
  up: number;
}

export interface Stand {
  /** Metres from the start. */
  away: number;
  /** Radians to the right of straight at the wall, and up. */
  heading: number;
  pitch: number;
}

export interface Lens {
  /** Tangents of half the angle of view, across and up. */
  wide: number;
  tall: number;
  /** What nothing covers, in -1..1 from the left bottom. */
  free: Box2;
}

/** The nearest stand between `near` and `far` that sees all of it; the farthest where none does. */
export function standFor(sights: Sight[], lens: Lens, near: number, far: number): Stand {
  for (let away = near; ; away = Math.min(far, away * 1.04)) {
    const stand = look(sights, lens, away);
    if (away >= far || sees(stand, sights, lens)) return stand;
  }
}

/** The look from `away` that has as much room left as right of what is seen, and as much above as below. */
function look(sights: Sight[], lens: Lens, away: number): Stand {
  const ahead = ({ out }: Sight): number => Math.max(away - out, 0.1);
  const centred = (angles: number[], low: number, high: number, tan: number): number =>
    (Math.max(...angles) + Math.min(...angles) - Math.atan(tan * low) - Math.atan(tan * high)) / 2;
  const { min, max } = lens.free;
  const sides = sights.map((sight) => Math.atan2(sight.side, ahead(sight)));
  const heading = centred(sides, min.x, max.x, lens.wide);
  const turned = (sight: Sight): number =>
    ahead(sight) * Math.cos(heading) + sight.side * Math.sin(heading);
  const heights = sights.map((sight) => Math.atan2(sight.up, Math.max(turned(sight), 0.1)));
  return { away, heading, pitch: centred(heights, min.y, max.y, lens.tall) };
}

function sees({ away, heading, pitch }: Stand, sights: Sight[], lens: Lens): boolean {
  const { min, max } = lens.free;
  return sights.every(({ out, side, up }) => {
    const ahead = (away - out) * Math.cos(heading) + side * Math.sin(heading);
    const across = side * Math.cos(heading) - (away - out) * Math.sin(heading);
    const depth = ahead * Math.cos(pitch) + up * Math.sin(pitch);
    if (depth < 0.1) return false;
    const x = across / depth / lens.wide;
    const y = (up * Math.cos(pitch) - ahead * Math.sin(pitch)) / depth / lens.tall;
    const slack = 1e-6;
    return x > min.x - slack && x < max.x + slack && y > min.y - slack && y < max.y + slack;
  });
}
