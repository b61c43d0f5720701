/** Estimated ranges of new routes beside the setter's grades. They can be hidden. */

import { answer, api, type Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import { loading, type Loaded } from "../lib/loaded.svelte";
import { reloadWhileWaiting } from "./waiting.svelte";

const KEPT = "walltopo-review-ranges";
export class Ranges {
  shown = $state(localStorage.getItem(KEPT) !== "no");
  readonly result: Loaded<Schemas["GradeRanges"] | null>;

  /** Create it while a component is initialised; `ready`: whether there is a draft. */
  constructor(path: () => { gym: string; scan: string }, ready: () => boolean) {
    this.result = loading(async () => {
      if (!ready() || !this.shown) return null;
      return answer(api.GET("/api/v1/gyms/{gym}/scans/{scan}/grade-ranges", { params: { path: path() } }));
    });
    reloadWhileWaiting(this.result);
  }

  show(shown: boolean): void {
    this.shown = shown;
    localStorage.setItem(KEPT, shown ? "yes" : "no");
  }

  /** The text beside the grade of a new route; empty: none. */
  of(number: number, systems: Schemas["GradeSystemOut"][]): string {
    const result = this.result.data;
    if (!this.shown || result?.state !== "ready") return "";
    const range = result.routes.find((row) => row.number === number);
    if (!range) return t("review.noWay");
    const kinds = systems.map(({ kind }) => kind);
    // A single V grade may cover the whole range: then use Font grades, which are finer.
    const inV = kinds.includes("v") && !kinds.includes("font") && range.low_v !== range.high_v;
    const ends = inV ? { low: range.low_v, high: range.high_v } : { low: range.low, high: range.high };
    return result.graded === 0 ? t("review.aboutBoard", ends) : t("review.about", { ...ends, count: result.graded });
  }
}
