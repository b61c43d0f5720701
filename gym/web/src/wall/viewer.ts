/** `<wall-topo>`, walltopo's viewer (docs/viewer.md): a script of its own, loaded when a wall is shown. */

import { loadViewer } from "./script";

export interface WallElement extends HTMLElement {
  selectedRoute: number | null;
  selectRoute(id: number | null, options?: { move?: boolean }): void;
  showRoutes(ids: Iterable<number> | null): void;
  showHeat(values: Iterable<[number, number]> | null, words?: { title: string; low: string; high: string } | null): void;
  home(): void;
  climberView(): void;
  swing(share: number): void;
}

let loaded: Promise<void> | undefined;

/** Defines the element; asked again after it failed, it tries again. */
export function defineViewer(): Promise<void> {
  loaded ??= window.wallViewer ?? loadViewer();
  loaded.catch(() => {
    loaded = undefined;
    delete window.wallViewer;
  });
  return loaded;
}

/** Begins to fetch it, for a page that will show a wall; that one tells what went wrong. */
export function expectViewer(): void {
  defineViewer().catch(() => undefined);
}
