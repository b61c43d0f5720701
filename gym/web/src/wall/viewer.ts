/** `<wall-topo>`, walltopo's viewer (docs/viewer.md): a script of its own, loaded when a wall is shown. */

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

/** Defines the element. The server says in the page where its script is. */
export function defineViewer(): Promise<void> {
  loaded ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = document.querySelector<HTMLMetaElement>('meta[name="wall-viewer"]')?.content ?? "";
    script.onload = () => resolve();
    script.onerror = () => {
      loaded = undefined;
      script.remove();
      reject(new TypeError("the viewer was not loaded"));
    };
    document.head.append(script);
  });
  return loaded;
}

/** Begins to fetch it, for a page that will show a wall; that one tells what went wrong. */
export function expectViewer(): void {
  defineViewer().catch(() => undefined);
}
