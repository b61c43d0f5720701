/** A value for each route or hold, shown as the colour of holds: from pale to dark, distinct without hue too. */

import { Color } from "three";
import type { Tables } from "../data/types";
import { h } from "../panels/dom";

/** From 0 to 1, lightness falling all the way. */
const RAMP = ["#fff0a8", "#f5832a", "#7d0f3f"] as const;

/** Texts of the legend: its title, and the ends of the scale. */
export interface HeatmapLegend {
  title: string;
  low: string;
  high: string;
}

/** The subject of a value: routes, by route id, or single holds, by hold id. */
export type HeatmapSubject = "routes" | "holds";

export class Heatmap {
  private values: Map<number, number> | null = null;
  private of: HeatmapSubject = "routes";
  readonly root = h("div", { class: "heat", part: "heat", hidden: true });

  /** By id, 0 to 1; null: none is shown. The rest fades. */
  set(values: Iterable<[number, number]> | null, words: HeatmapLegend | null, of: HeatmapSubject): void {
    this.values = values && new Map(values);
    this.of = of;
    this.root.hidden = this.values === null || words === null;
    if (!words) return;
    const bar = h("i", { style: `background:linear-gradient(90deg, ${RAMP.join(", ")})` });
    this.root.replaceChildren(h("b", {}, words.title), bar, h("span", {}, words.low), h("span", {}, words.high));
  }

  get shown(): boolean {
    return this.values !== null;
  }

  /** 1 to 255 by hold id; a hold of two routes has the hotter one's. */
  holds(tables: Tables): Map<number, number> {
    const found = new Map<number, number>();
    for (const [id, value] of this.values ?? []) {
      const heat = 1 + Math.round(254 * Math.min(1, Math.max(0, value)));
      const holds = this.of === "holds" ? [id] : (tables.routes.get(id)?.holds ?? []);
      for (const hold of holds) found.set(hold, Math.max(heat, found.get(hold) ?? 0));
    }
    return found;
  }
}

/** @internal The ramp as the shader has it, in linear light. */
export const rampColours = (): Color[] => RAMP.map((colour) => new Color(colour));
