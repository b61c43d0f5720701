/** The methods of the edited element that the editor needs. */

import type { Hold, Route, Tables, Vec3 } from "../data/types";
import type { Stage } from "../scene/stage";

export interface EditorHost {
  readonly view: HTMLElement;
  readonly stage: Stage;
  readonly canvas: HTMLCanvasElement;
  /** Whether one finger draws on the wall instead of turning it. */
  draw(drawing: boolean): void;
  chosen(): { route: Route | null; hold: Hold | null };
  /** Show these tables; what is chosen stays where it is still there. */
  show(tables: Tables): void;
  select(route: number | null, hold: number | null): void;
  /** Bring a place into the middle. */
  look(place: Vec3): void;
  /** Draw what is chosen and marked anew, and the card. */
  refresh(): void;
  /** Dots over the picture. */
  dots(places: Vec3[]): void;
  /** Bring a route into the picture, one that the tables do not have too. */
  frame(route: Route): void;
  say(text: string): void;
}
