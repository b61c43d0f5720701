/** A climber's position and direction of view that bring a whole route into the free part of the picture. */

import type { Box2 } from "three";

/** A place as seen from the start: metres towards the climber, to the right, over the eyes. */
export interface RelativePlace {
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
  /** The free part of the picture, in -1..1 from the left bottom. */
  free: Box2;
}

/** The nearest stand between `near` and `far` that sees all places; the farthest if none does. */
export function standFor(places: RelativePlace[], lens: Lens, near: number, far: number): Stand {
  for (let away = near; ; away = Math.min(far, away * 1.04)) {
    const stand = look(places, lens, away);
    if (away >= far || sees(stand, places, lens)) return stand;
  }
}

/** The view from `away` that has the places in its centre. */
function look(places: RelativePlace[], lens: Lens, away: number): Stand {
  const ahead = ({ out }: RelativePlace): number => Math.max(away - out, 0.1);
  const centred = (angles: number[], low: number, high: number, tan: number): number =>
    (Math.max(...angles) + Math.min(...angles) - Math.atan(tan * low) - Math.atan(tan * high)) / 2;
  const { min, max } = lens.free;
  const sides = places.map((place) => Math.atan2(place.side, ahead(place)));
  const heading = centred(sides, min.x, max.x, lens.wide);
  const turned = (place: RelativePlace): number =>
    ahead(place) * Math.cos(heading) + place.side * Math.sin(heading);
  const heights = places.map((place) => Math.atan2(place.up, Math.max(turned(place), 0.1)));
  return { away, heading, pitch: centred(heights, min.y, max.y, lens.tall) };
}

function sees({ away, heading, pitch }: Stand, places: RelativePlace[], lens: Lens): boolean {
  const { min, max } = lens.free;
  return places.every(({ out, side, up }) => {
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
