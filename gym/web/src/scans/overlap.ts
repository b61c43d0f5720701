import { answer, api, type Schemas } from "../api/client";

const EVERY_MS = 1000;

/** Request the overlap of a scan's photos until it is computed. Returns how to stop. */
export function pollOverlap(gym: string, scan: string, show: (facts: Schemas["OverlapOut"] | null) => void): () => void {
  let timer = 0;
  let stopped = false;
  const ask = async (): Promise<void> => {
    // Only a hint: without it, the scan itself reports unplaced photos.
    const facts = await answer(api.GET("/api/v1/gyms/{gym}/scans/{scan}/overlap", { params: { path: { gym, scan } } })).catch(() => null);
    if (stopped) return;
    show(facts);
    if (facts?.pending) timer = window.setTimeout(ask, EVERY_MS);
  };
  void ask();
  return () => {
    stopped = true;
    clearTimeout(timer);
  };
}
