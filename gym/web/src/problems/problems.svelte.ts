/** A wall's problems: those of the server, and one's own that wait here. */

import { answer, api, type Schemas } from "../api/client";
import { loadingKept, type Loaded } from "../lib/loaded.svelte";
import { PROBLEMS_SHOWN } from "../offline/keepGym";
import { offlineSince } from "../offline/reception.svelte";
import { mine, say } from "../outbox/outbox.svelte";
import { acceptedKey, settle, type Item, type ProblemIn } from "../outbox/store";
import { me } from "../session.svelte";

type Facts = Schemas["ClimberProblem"];
/** `waits`: the server may not have it, or not as it is now. */
export type WallProblem = Facts & { waits: boolean };

function isOurs(item: Item): boolean {
  return item.what === "problem" || item.what === "climbed";
}

export class WallProblems {
  readonly first: Loaded<Schemas["Page_ClimberProblem_"]>;
  /** Pages after the first. */
  private later = $state.raw<Facts[]>([]);
  private cursor = $state<string | null>(null);
  private readonly entered = $derived.by(() => mine().filter((item) => item.gym === this.gym() && isOurs(item) && !item.refused));
  readonly rows = $derived.by(() => this.gather());

  /** People who are not members see no list, only problems that are shared by link. */
  constructor(
    private readonly gym: () => string,
    private readonly wall: () => string,
    isMember: () => boolean,
    /** Only problems with this hold of the published version. */
    private readonly hold: () => number | null,
  ) {
    this.first = loadingKept(async (how) => {
      const [slug, id, requested] = [gym(), wall(), Date.now()];
      void acceptedKey(this.entered);
      if (!isMember()) return { items: [], next: null };
      // Without reception, the page looks among those that are stored.
      const wanted = offlineSince() ? null : hold();
      const params = { path: { gym: slug, wall: id }, query: { size: PROBLEMS_SHOWN, ...(wanted === null ? {} : { hold: wanted }) } };
      const page = await answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}/problems", { params, ...how }));
      this.later = [];
      this.cursor = page.next;
      // A search does not list all that the server has.
      // Afterwards, as the page would show the older state for a moment.
      if (wanted === null && !how.cache && !offlineSince()) void settle(requested, (item) => isOurs(item) && item.gym === slug && item.person === me()?.id);
      return page;
    });
  }

  get hasMore(): boolean {
    return this.cursor !== null;
  }

  async more(): Promise<void> {
    const hold = this.hold();
    const query = { size: PROBLEMS_SHOWN, cursor: this.cursor!, ...(hold === null ? {} : { hold }) };
    const params = { path: { gym: this.gym(), wall: this.wall() }, query };
    const page = await answer(api.GET("/api/v1/gyms/{gym}/walls/{wall}/problems", { params }));
    this.later = [...this.later, ...page.items];
    this.cursor = page.next;
  }

  find(id: string): WallProblem | null {
    return this.rows.find((row) => row.id === id) ?? null;
  }

  /** Store a problem; `before` is what the server had of it. */
  async keep(id: string, words: ProblemIn, before: WallProblem | null): Promise<void> {
    await say({ what: "problem", id, person: me()!.id, gym: this.gym(), name: words.name, body: words, takenBack: false, known: before !== null });
  }

  async drop(problem: WallProblem, scan: string): Promise<void> {
    const { id, wall_id, holds, name, grade_system_id, grade, share, matching, note, remix_of } = problem;
    const body = { wall_id, scan_id: scan, holds, name, grade_system_id, grade, share, matching, note, remix_of };
    await say({ what: "problem", id, person: me()!.id, gym: this.gym(), name, body, takenBack: true, known: true });
  }

  async climb(problem: WallProblem, isClimbed: boolean): Promise<void> {
    const body = { climbed_at: isClimbed ? new Date().toISOString() : null };
    await say({ what: "climbed", problem: problem.id, person: me()!.id, gym: this.gym(), name: problem.name, body });
  }

  private gather(): WallProblem[] {
    const rows = new Map<string, WallProblem>();
    for (const row of [...(this.first.data?.items ?? []), ...this.later]) rows.set(row.id, { ...row, waits: false });
    for (const item of this.entered) {
      const waits = item.done === null;
      if (item.what === "climbed") {
        const row = rows.get(item.problem);
        if (row) rows.set(row.id, { ...row, ...climbedBy(row, item.body.climbed_at), waits: row.waits || waits });
      } else if (item.what === "problem" && item.body.wall_id === this.wall()) {
        if (item.takenBack) rows.delete(item.id);
        else rows.set(item.id, { ...made(item.id, item.body, item.at), ...rows.get(item.id), ...item.body, gone: 0, waits });
      }
    }
    return [...rows.values()].sort((a, b) => b.created_at.localeCompare(a.created_at));
  }
}

function climbedBy(row: WallProblem, at: string | null): Pick<WallProblem, "climbed_at" | "climbers"> {
  const change = Number(at !== null) - Number(row.climbed_at !== null);
  return { climbed_at: at, climbers: row.climbers + change };
}

/** A problem that the server does not have yet. */
function made(id: string, words: ProblemIn, at: number): Facts {
  const { wall_id, holds, name, grade_system_id, grade, share, matching, note, remix_of } = words;
  return {
    id, wall_id, holds, name, grade_system_id, grade, share, matching, note, remix_of,
    gone: 0, author_id: me()?.id ?? null, author: me()?.name ?? "", climbers: 0, climbed_at: null,
    route_id: null, hidden: false, created_at: new Date(at).toISOString(),
  };
}
