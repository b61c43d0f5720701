/** A cursor that goes from hold to hold by keys. */

export type Direction = "left" | "right" | "up" | "down";

interface Place {
  x: number;
  y: number;
}

/** How far a place lies in a direction, and how far beside it; y grows downwards. */
const OFFSETS: Record<Direction, (dx: number, dy: number) => [ahead: number, aside: number]> = {
  left: (dx, dy) => [-dx, Math.abs(dy)],
  right: (dx, dy) => [dx, Math.abs(dy)],
  up: (dx, dy) => [-dy, Math.abs(dx)],
  down: (dx, dy) => [dy, Math.abs(dx)],
};

/**
 * The id of the nearest place within 45 degrees of a direction, or null. The four directions cover the picture, and
 * each step comes nearer to what lies in its direction, so every place can be reached.
 */
export function nextInDirection(places: ReadonlyMap<number, Place>, from: Place, to: Direction): number | null {
  let best: number | null = null;
  let nearest = Infinity;
  for (const [id, { x, y }] of places) {
    const [ahead, aside] = OFFSETS[to](x - from.x, y - from.y);
    const distance = Math.hypot(ahead, aside);
    if (ahead <= 0 || aside > ahead || distance >= nearest) continue;
    [best, nearest] = [id, distance];
  }
  return best;
}

/** The id of the place nearest to a point, or null without places. */
export function nearestTo(places: ReadonlyMap<number, Place>, { x, y }: Place): number | null {
  let best: number | null = null;
  let nearest = Infinity;
  for (const [id, place] of places) {
    const distance = Math.hypot(place.x - x, place.y - y);
    if (distance < nearest) [best, nearest] = [id, distance];
  }
  return best;
}
