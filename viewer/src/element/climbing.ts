/** The figure that climbs the selected route, where the page names a `moves.json`, or a set of holds that has moves. */

import type { HoldSet } from "../data/types";
import type { RouteMoves } from "../data/wire";
import { readMoves } from "../moves/moves_file";
import type { Moves, Person } from "../moves/moves_file";
import { Player } from "../moves/player";
import type { Parts } from "./parts";

export class Climbing {
  /** The figure on the wall, with its controls. */
  player: Player | null = null;
  private moves: Moves | null = null;
  /** The address that `moves` was read from. */
  private source: string | null = null;

  /** `set`: the holds in the stead of a route. `changed`: called when the card has to show something else. */
  constructor(
    private readonly parts: Parts,
    private readonly set: () => HoldSet | null,
    private readonly changed: () => void,
  ) {}

  /** The moves of the selected route, or of the set in its stead; null where none are known. */
  get ofRoute(): RouteMoves | null {
    const set = this.set();
    if (set) return set.moves ? { route: 0, climbers: set.moves.climbers } : null;
    return this.moves?.routes.get(this.parts.selected.route ?? -1) ?? null;
  }

  /** Whether some climber gets off the ground on the selected route. */
  get isPossible(): boolean {
    return this.ofRoute?.climbers.some(({ moves }) => moves.length > 0) ?? false;
  }

  /** The address of the moves that the page wants. */
  private get wanted(): string | null {
    return this.parts.element.getAttribute("moves");
  }

  /** Whether the moves are there, or nothing is to be read. */
  get isRead(): boolean {
    return this.set() !== null || (this.moves !== null && this.source === this.wanted);
  }

  async read(signal: AbortSignal): Promise<void> {
    const source = this.wanted;
    this.stop();
    const moves = source ? await readMoves(source, this.parts.tables, signal) : null;
    if (source !== this.wanted) return; // another file is read meanwhile
    this.moves = moves;
    this.source = source;
    if (!signal.aborted && this.moves) this.changed();
  }

  /** Put a figure on the selected route; null where no moves are known. */
  begin(person: Person | null = null): Player | null {
    const { parts, ofRoute } = this;
    const unit = this.set()?.moves?.unit ?? this.moves?.unit;
    if (!parts.stage || unit === undefined || !ofRoute || !this.isPossible) {
      this.stop();
      return null;
    }
    this.player?.dispose();
    this.player = new Player(parts.stage, parts.tables, ofRoute, unit, {
      close: () => this.end(),
      person,
      shows: (climber) => parts.emit("moves-show", { climber }),
    });
    this.changed();
    return this.player;
  }

  /** Take the figure away, and show the card of the route again. */
  end(): void {
    if (!this.player) return;
    this.stop();
    this.changed();
  }

  /** Take the figure away. */
  stop(): void {
    if (!this.player) return;
    this.player.dispose();
    this.player = null;
    this.parts.emit("moves-show", { climber: null });
  }
}
