/** The script that defines `<wall-topo>`, and the last visited wall: shared by `early.ts` and the app. */

const KEPT = "walltopo-last-wall";

export interface LastWall {
  /** Path of its page; those of its routes begin with it. */
  page: string;
  /** Address of its folder of files. */
  base: string;
  title: string;
  /** Address of its picture. */
  poster: string;
}

declare global {
  interface Window {
    /** `early.ts` has requested the script already. */
    wallViewer?: Promise<void>;
  }
}

/** Stores what a wall's page shows, for its next visit. */
export function rememberWall(wall: LastWall): void {
  localStorage.setItem(KEPT, JSON.stringify(wall));
}

/** The wall of this page or of one of its routes, if it was the last visited one. */
export function lastWall(path: string): LastWall | null {
  const last = JSON.parse(localStorage.getItem(KEPT) ?? "null") as LastWall | null;
  return last && `${path}/`.startsWith(`${last.page}/`) ? last : null;
}

export function forgetWall(): void {
  localStorage.removeItem(KEPT);
}

/** Adds the script to the page. The page's head has its address. */
export function loadViewer(): Promise<void> {
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = document.querySelector<HTMLMetaElement>('meta[name="wall-viewer"]')?.content ?? "";
    script.dataset.worker = "file"; // the page's policy allows it (`server/pages.py`)
    script.onload = () => resolve();
    script.onerror = () => {
      script.remove();
      reject(new TypeError("the viewer was not loaded"));
    };
    document.head.append(script);
  });
}
