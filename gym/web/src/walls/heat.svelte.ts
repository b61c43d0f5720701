/** Values of routes or holds that a page shows as colours on the wall. */

export interface Heat {
  /** From 0 to 1, by the route's number or the hold's id. */
  values: [number, number][];
  title: string;
  low: string;
  high: string;
  of?: "routes" | "holds";
}

/** Heat that a part beside the wall wants to be shown. */
export class WantedHeat {
  shown = $state.raw<Heat | null>(null);
}
