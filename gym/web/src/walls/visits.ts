/** One's last visits of a gym's pages, stored in this browser: routes set since then are new. */

const KEPT = "walltopo-visits";
// Another look between two tries belongs to the same visit.
const APART_MS = 6 * 3_600_000;
const FIRST_DAYS = 14;

interface Visit {
  /** Day of the visit before this one. */
  before: string;
  /** Time of the last look, ms. */
  seen: number;
}

function read(): Record<string, Visit> {
  try {
    return JSON.parse(localStorage.getItem(KEPT) ?? "{}") as Record<string, Visit>;
  } catch {
    return {};
  }
}

function dayOf(moment: number): string {
  return new Date(moment).toISOString().slice(0, 10);
}

/** Day of the visit before this one; two weeks ago for a first visit. */
export function lastVisit(gym: string): string {
  const [visits, now] = [read(), Date.now()];
  const old = visits[gym];
  const before = !old ? dayOf(now - FIRST_DAYS * 86_400_000) : now - old.seen > APART_MS ? dayOf(old.seen) : old.before;
  localStorage.setItem(KEPT, JSON.stringify({ ...visits, [gym]: { before, seen: now } }));
  return before;
}
