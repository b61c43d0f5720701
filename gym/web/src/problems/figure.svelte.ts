/** The figure on a problem; its moves are computed when somebody wants to see them. */

import { answer, api, type Schemas } from "../api/client";
import type { ProblemIn } from "../outbox/store";
import { Figure } from "../walls/figure.svelte";

export class ProblemFigure extends Figure {
  /** The moves that were computed last, and their holds as JSON. */
  private found = $state.raw<{ of: string; moves: Schemas["ProblemMoves"] } | null>(null);

  /** The moves of these holds, if they are known. */
  movesOf(holds: ProblemIn["holds"]): Schemas["ProblemMoves"] | null {
    return this.found?.of === JSON.stringify(holds) ? this.found.moves : null;
  }

  async find(gym: string, wall: string, scan: string, holds: ProblemIn["holds"]): Promise<void> {
    if (this.movesOf(holds)) return;
    const moves = await answer(api.POST("/api/v1/gyms/{gym}/walls/{wall}/problem-moves", { params: { path: { gym, wall } }, body: { scan_id: scan, holds } }));
    this.found = { of: JSON.stringify(holds), moves: moves as Schemas["ProblemMoves"] };
  }
}
