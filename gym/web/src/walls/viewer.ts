/** `<wall-topo>`, walltopo's viewer (docs/viewer.md): a script of its own, loaded when a wall is shown. */

import type { Schemas } from "../api/client";
import { loadViewer } from "./script";

/** Height and arm span in metres. */
export interface Person {
  height_m: number;
  span_m: number | null;
}

/** A body whose moves were computed. */
export interface Climber {
  climber: string;
  height_m: number;
}

/** Holds of a climb that is no route of the scan, by id. */
export interface HoldSet {
  holds: number[];
  start: number[];
  top: number[];
  feet: number[];
  /** How several bodies may climb them. */
  moves?: Schemas["ProblemMoves"] | null;
}

export interface WallElement extends HTMLElement {
  selectedRoute: number | null;
  readonly selectedHold: number | null;
  /** Whether taps measure a distance. */
  measuring: boolean;
  /** Whether taps emit `point-tap` with their place on the wall. */
  pointing: boolean;
  selectHold(id: number | null): void;
  describeHold(id: number): string;
  pointToHold(id: number | null): void;
  pointToRoute(id: number | null): void;
  selectRoute(id: number | null, options?: { move?: boolean }): void;
  showRoutes(ids: Iterable<number> | null): void;
  showHolds(set: HoldSet | null, options?: { move?: boolean }): void;
  showLines(lines: Point[][]): void;
  showRopes(ropes: Point[][]): void;
  showHeat(values: Iterable<[number, number]> | null, words?: { title: string; low: string; high: string } | null, of?: "routes" | "holds"): void;
  showMoves(person: Person | null): Promise<Climber | null>;
  hideMoves(): void;
  home(): void;
  climberView(): void;
  swing(share: number): void;
}

export type Point = [number, number, number];

let loaded: Promise<void> | undefined;

/** Defines the element; a call after a failure tries again. */
export function defineViewer(): Promise<void> {
  loaded ??= window.wallViewer ?? loadViewer();
  loaded.catch(() => {
    loaded = undefined;
    delete window.wallViewer;
  });
  return loaded;
}

/** Prefetches it for a page that will show a wall; that page reports failures. */
export function expectViewer(): void {
  defineViewer().catch(() => undefined);
}
