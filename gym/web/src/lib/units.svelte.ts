/** The units in which this browser shows lengths: those that its reader chose, else those of the gym seen last. */

import { inCentimetres, inMetres, type Measures, type Units } from "../../../../viewer/src/data/lengths";
import { locale } from "../i18n.svelte";

export type { Units };
export const UNITS = ["metric", "imperial"] as const satisfies Units[];

const OWN = "walltopo-units";
const OF_GYM = "walltopo-gym-units";

function kept(key: string): Units | null {
  const name = localStorage.getItem(key);
  return UNITS.find((each) => each === name) ?? null;
}

let own = $state(kept(OWN));
let ofGym = $state(kept(OF_GYM));

export function units(): Units {
  return own ?? ofGym ?? "metric";
}

/** Null: as the gym. */
export function ownUnits(): Units | null {
  return own;
}

export function measureIn(next: Units | null): void {
  if (next) localStorage.setItem(OWN, next);
  else localStorage.removeItem(OWN);
  own = next;
}

export function followGym(next: Units): void {
  localStorage.setItem(OF_GYM, next);
  ofGym = next;
}

const measures = (): Measures => ({ units: units(), code: locale() });

/** "1.75 m", with at least and at most so many decimals; "5 ft 9 in". */
export const metres = (value: number, least = 2, most = 2): string => inMetres(value, measures(), least, most);

/** "3.2 cm", with at most so many decimals; "1.3 in". */
export const centimetres = (value: number, most = 0): string => inCentimetres(value / 100, measures(), most);
