/** The address of a wall as it was on the day of an ascent, with its route lit. */

import { p } from "../routes";

export function pastWall(gym: string, wall: string, route: string, on: string): string {
  return `${p("/g/:gym/w/:wall/past", { params: { gym, wall } })}?${new URLSearchParams({ route, on })}`;
}
