/** The figure that climbs a route in the viewer: requested by the route's card, shown by the wall. */

import type { Climber, Person } from "./viewer";

/** The address of the moves (null: the set of holds on the wall has them), and the person whose reach the figure should have; null: an adult's. */
export interface Climb {
  moves: string | null;
  person: Person | null;
}

export class Figure {
  wanted = $state.raw<Climb | null>(null);
  /** The climber on the wall. */
  shown = $state.raw<Climber | null>(null);
  hasFailed = $state(false);

  show(climb: Climb): void {
    this.hasFailed = false;
    this.wanted = climb;
  }

  hide(): void {
    this.hasFailed = false;
    this.wanted = null;
  }

  /** Take over the climber that the viewer shows; null also after it was closed there, or another route was selected. */
  changed(climber: Climber | null): void {
    this.shown = climber;
    if (!climber) this.wanted = null;
  }

  failed(climb: Climb): void {
    if (this.wanted !== climb) return;
    this.wanted = null;
    this.hasFailed = true;
  }
}
