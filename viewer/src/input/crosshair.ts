/** A crosshair that keys move over the picture, for taps that need a place of the wall and not a hold. */

import { h } from "../panels/dom";
import type { Direction } from "./hold_cursor";

const STEP = 12; // CSS pixels

const STEPS: Record<Direction, [x: number, y: number]> = { left: [-STEP, 0], right: [STEP, 0], up: [0, -STEP], down: [0, STEP] };

export class Crosshair {
  /** Seen while the picture has a class that says what taps are for. */
  readonly root = h("div", { class: "crosshair", "aria-hidden": "true" });
  /** CSS pixels from the picture's top left; null before it was needed. */
  place: { x: number; y: number } | null = null;

  constructor() {
    this.hide();
  }

  show(place: { x: number; y: number }): void {
    this.place = place;
    this.root.hidden = false;
    this.root.style.transform = `translate(${place.x}px, ${place.y}px)`;
  }

  hide(): void {
    this.place = null;
    this.root.hidden = true;
  }

  /** One step within a picture of this size. */
  step(to: Direction, { clientWidth, clientHeight }: HTMLElement): void {
    if (!this.place) return;
    const [dx, dy] = STEPS[to];
    const within = (value: number, most: number): number => Math.min(Math.max(value, 0), most - 1);
    this.show({ x: within(this.place.x + dx, clientWidth), y: within(this.place.y + dy, clientHeight) });
  }
}
