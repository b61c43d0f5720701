/** The tables as the viewer has them: of the wire, or of another program, whose rows may lack much (`tables.ts`). */

import type { ClimberRow, Hold as HoldRow, Route as RouteRow, ShownHold } from "./wire";

type OrNull<T, K extends keyof T> = { [P in keyof T]: P extends K ? T[P] | null : T[P] };

type Measured = "type" | "colour" | "colour_rgb" | "second_colour" | "second_rgb" | "size_m" | "area_m2" | "steepness_deg";
type Known = Measured | "position" | "normal" | "score" | "route" | "review";
/** `left_out` and `cutout` are the editor's. */
export type Hold = OrNull<
  Required<Pick<HoldRow, Known>> & Pick<HoldRow, "id" | "class" | "photos"> & { role?: string } & Pick<ShownHold, "left_out" | "cutout">,
  Measured
>;

type Facts = "holds" | "colour" | "length_m" | "steepness_deg";
export type Route = OrNull<Required<Pick<RouteRow, Facts>> & Omit<RouteRow, Facts>, "colour" | "length_m" | "steepness_deg">;

export interface Tables {
  title: string;
  metric: boolean;
  holds: Map<number, Hold>;
  routes: Map<number, Route>;
}

/** Holds of a climb that is no route of the scan, by id: all of them, and those with a flag. */
export interface HoldSet {
  holds: number[];
  start: number[];
  top: number[];
  feet: number[];
  /** How several bodies may climb them; a scan unit is a metre over `unit`. */
  moves?: { unit: number; climbers: ClimberRow[] } | null;
}

export type Vec3 = [number, number, number];
