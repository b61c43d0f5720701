/** About how hard the new routes are: ranges beside the grades that a setter gives. They can be hidden. */

import { answer, api, type Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import { loading, type Loaded } from "../lib/loaded.svelte";

const KEPT = "walltopo-review-ranges";
const FIRST_WAIT_MS = 1500;
const LONGEST_WAIT_MS = 30_000;

export class Ranges {
  shown = $state(localStorage.getItem(KEPT) !== "no");
  readonly told: Loaded<Schemas["GradeRanges"] | null>;
  private wait = FIRST_WAIT_MS;

  /** Made while a component is; `ready`: whether there is a draft that they are of. */
  constructor(path: () => { gym: string; scan: string }, ready: () => boolean) {
    this.told = loading(async () => {
      if (!ready() || !this.shown) return null;
      return answer(api.GET("/api/v1/gyms/{gym}/scans/{scan}/grade-ranges", { params: { path: path() } }));
    });
    $effect(() => {
      if (this.told.data?.state !== "waiting") return;
      const later = setTimeout(() => void this.told.load(), this.wait);
      this.wait = Math.min(1.5 * this.wait, LONGEST_WAIT_MS);
      return () => clearTimeout(later);
    });
  }

  show(shown: boolean): void {
    this.shown = shown;
    localStorage.setItem(KEPT, shown ? "yes" : "no");
  }

  /** What is said beside the grade of a new route; empty: nothing. */
  of(number: number, systems: Schemas["GradeSystemFacts"][]): string {
    const told = this.told.data;
    if (!this.shown || told?.state !== "ready") return "";
    const range = told.routes.find((row) => row.number === number);
    if (!range) return t("review.noWay");
    const kinds = systems.map(({ kind }) => kind);
    // One V grade may be all of a range: it is then told in Font grades, which are finer.
    const inV = kinds.includes("v") && !kinds.includes("font") && range.low_v !== range.high_v;
    const ends = inV ? { low: range.low_v, high: range.high_v } : { low: range.low, high: range.high };
    return told.graded === 0 ? t("review.aboutBoard", ends) : t("review.about", { ...ends, count: told.graded });
  }
}
