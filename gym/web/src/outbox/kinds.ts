/** Results of an ascent, and those that each discipline has; as on the server (`climbing/kinds.py`). */

import type { Schemas } from "../api/client";

export type Discipline = Schemas["Discipline"];
export type Kind = Schemas["AscentOut"]["kind"];

export const FIRST_TRIES: readonly Kind[] = ["onsight", "flash"];
export const TOPS: readonly Kind[] = [...FIRST_TRIES, "top", "repeat"];

/** All results, the best first. */
export const KINDS: readonly Kind[] = [...TOPS, "hang", "high-point", "zone", "try", "project"];

const OF_BOULDERS: readonly Kind[] = ["flash", "top", "zone", "try", "project"];
const ON_ROPES: readonly Kind[] = [...TOPS, "hang", "high-point", "try", "project"];

export function kindsOf(discipline: Discipline): readonly Kind[] {
  return discipline === "boulder" ? OF_BOULDERS : ON_ROPES;
}
