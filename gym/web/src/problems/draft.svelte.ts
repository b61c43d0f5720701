/** A problem that is being made, changed or remixed. */

import { SvelteMap } from "svelte/reactivity";
import type { ProblemIn } from "../outbox/store";
import type { HoldSet } from "../walls/viewer";
import type { WallProblem } from "./problems.svelte";

export const USES = ["start", "hand", "foot", "top"] as const;
export type Use = (typeof USES)[number];
type Used = ProblemIn["holds"];

/** The holds as the viewer shows them, with their moves if they are known. */
export function setOf(holds: Used, moves: HoldSet["moves"]): HoldSet {
  const of = (use: Use): number[] => holds.filter((each) => each.use === use).map(({ hold }) => hold);
  return { holds: holds.map(({ hold }) => hold), start: of("start"), top: of("top"), feet: of("foot"), moves };
}

export class ProblemDraft {
  readonly uses = new SvelteMap<number, Use>();
  /** The use with which the next tap marks a hold. */
  use = $state<Use>("start");
  name = $state("");
  /** System and label, with a line break between; empty: no grade. */
  grade = $state("");
  share = $state<ProblemIn["share"]>("gym");
  matching = $state(true);
  note = $state("");

  /** `kind`: the same problem again, or a new one with its holds. */
  constructor(readonly from: WallProblem | null = null, readonly kind: "new" | "change" | "remix" = "new") {
    for (const { hold, use } of from?.holds ?? []) this.uses.set(hold, use);
    if (from && kind === "change") {
      this.name = from.name;
      this.note = from.note;
      this.share = from.share;
    }
    if (from) {
      this.grade = from.grade_system_id ? `${from.grade_system_id}\n${from.grade}` : "";
      this.matching = from.matching;
    }
  }

  /** Marks a hold, or removes the mark that it has. */
  tap(hold: number): void {
    if (this.uses.get(hold) === this.use) this.uses.delete(hold);
    else this.uses.set(hold, this.use);
  }

  count(use: Use): number {
    return [...this.uses.values()].filter((each) => each === use).length;
  }

  /** Whether the server would take these holds. */
  get isComplete(): boolean {
    const [start, top] = [this.count("start"), this.count("top")];
    return start >= 1 && start <= 4 && top >= 1 && top <= 2 && this.uses.size <= 60;
  }

  get holds(): Used {
    return [...this.uses].map(([hold, use]) => ({ hold, use }));
  }

  words(wall: string, scan: string): ProblemIn {
    const [system, label] = this.grade.split("\n");
    return {
      wall_id: wall,
      scan_id: scan,
      holds: this.holds,
      name: this.name.replace(/\s+/g, " ").trim(),
      grade_system_id: system || null,
      grade: label ?? "",
      share: this.share,
      matching: this.matching,
      note: this.note.replace(/\s+/g, " ").trim(),
      remix_of: this.kind === "remix" ? (this.from?.id ?? null) : (this.from?.remix_of ?? null),
    };
  }
}
