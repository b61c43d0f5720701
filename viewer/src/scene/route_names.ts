/** Names of routes at their starts, where colours do not tell them apart. */

import type { CameraRig } from "../camera/camera_rig";
import type { Vec3 } from "../data/types";
import { h } from "../panels/dom";

const GAP = 4; // CSS pixels between two names

export interface NamedPlace {
  name: string;
  place: Vec3;
}

interface Label extends NamedPlace {
  element: HTMLElement;
  width: number;
  height: number;
}

export class RouteNames {
  private labels: Label[] = [];
  private shown = "";

  constructor(private readonly root: HTMLElement) {}

  /** In the stead of those before. */
  set(places: NamedPlace[]): void {
    const text = JSON.stringify(places);
    if (text === this.shown) return;
    this.shown = text;
    for (const { element } of this.labels) element.remove();
    const elements = places.map(({ name }) => h("div", { class: "route-name", part: "route-name" }, name));
    this.root.append(...elements);
    this.labels = places.map((each, k) => {
      const element = elements[k]!;
      return { ...each, element, width: element.offsetWidth, height: element.offsetHeight };
    });
  }

  /** A name that would cover an earlier one is left out until there is room. */
  update(rig: CameraRig): void {
    const taken: { x: number; y: number; label: Label }[] = [];
    for (const label of this.labels) {
      const { x, y, ahead } = rig.project(label.place);
      const covers = taken.some(
        (other) =>
          Math.abs(x - other.x) < (label.width + other.label.width) / 2 + GAP &&
          Math.abs(y - other.y) < (label.height + other.label.height) / 2 + GAP,
      );
      const isShown = ahead && !covers;
      label.element.style.visibility = isShown ? "visible" : "hidden";
      if (!isShown) continue;
      label.element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, 8px)`;
      taken.push({ x, y, label });
    }
  }
}
