/** The focus of a list beside a wall, which the wall outlines. */

import type { WallElement } from "./viewer";

export class Pointing {
  private element = $state.raw<WallElement | null>(null);

  /** The wall that is shown; null before it stands. */
  at(element: WallElement | null): void {
    this.element = element;
  }

  /** Whether a wall stands, so that its holds have words. */
  get isReady(): boolean {
    return this.element !== null;
  }

  /** A hold in words, in the viewer's language. */
  words(hold: number): string {
    return this.element?.describeHold(hold) ?? "";
  }

  toHold(hold: number | null): void {
    this.element?.pointToHold(hold);
  }

  /** By the route's number in the scan. */
  toRoute(number: number | null): void {
    this.element?.pointToRoute(number);
  }
}
