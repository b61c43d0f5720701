/**
 * The package's entry: importing it defines `<wall-topo>`. Tables as in `holds.json` and
 * `routes.json`; see docs/viewer.md for attributes, parts and slots.
 */

import "./main";
import type { Hold, Route, Vec3 } from "./data/types";
import type { WallTopo } from "./element/wall_topo";

export { WallTopo } from "./element/wall_topo";
export type { GrabMode } from "./input/gesture_capture";
export type { Hold, HoldSet, Route, Vec3 } from "./data/types";

/** The events of the element. */
export interface WallTopoEventMap {
  "wall-load": CustomEvent<{ routes: number; holds: number }>;
  "wall-error": CustomEvent<{ message: string }>;
  "hold-select": CustomEvent<{ hold: Hold }>;
  "route-select": CustomEvent<{ route: Route | null }>;
  /** A tap after `showHolds`; null: beside all holds. */
  "hold-tap": CustomEvent<{ hold: Hold | null }>;
  /** A tap while `pointing`: its place in the scan's own frame and unit. */
  "point-tap": CustomEvent<{ point: Vec3 }>;
  /** `ends`: in the scan's own frame and unit. */
  measure: CustomEvent<{ text: string; ends: [Vec3, Vec3] }>;
}

declare global {
  interface HTMLElementTagNameMap {
    "wall-topo": WallTopo;
  }
  // The events bubble: elements above a wall, the document and the window hear them.
  interface GlobalEventHandlersEventMap extends WallTopoEventMap {}
}
