/** The units of lengths: all walls of a page have the same. */

import { say } from ".";
import type { Measures, Units } from "../data/lengths";

let units: Units = "metric";

/** Show lengths in these units; null: in metres. */
export function measureIn(wanted: string | null): void {
  units = wanted === "imperial" ? "imperial" : "metric";
}

/** How lengths are shown now. */
export const measures = (): Measures => ({ units, code: say().code });
