/** One's ascents and opinions in a gym: those of the server, and those that wait here. */

import { answer, api, type Schemas } from "../api/client";
import { loadingKept, type Loaded } from "../lib/loaded.svelte";
import { offlineSince } from "../offline/reception.svelte";
import { me } from "../session.svelte";
import { mine } from "./outbox.svelte";
import { KINDS, TOPS, type Kind } from "./kinds";
import { acceptedKey, settle, type AscentIn, type Item, type OpinionIn } from "./store";

/** `known`: the server has it, or may have. */
export type OwnAscent = AscentIn & { id: string; waits: boolean; known: boolean };

const NONE: Schemas["LogbookOut"] = { ascents: [], opinions: [] };

export class Logbook {
  private readonly entered = $derived.by(() => mine().filter((item) => item.gym === this.gym() && !item.refused));
  private readonly byRoute = $derived.by(() => this.gather());

  constructor(
    private readonly gym: () => string,
    private readonly known: Loaded<Schemas["LogbookOut"]>,
  ) {}

  /** Whether it is loaded; people who are not members have none. */
  get here(): boolean {
    return this.known.data !== undefined;
  }

  /** The last climbed first. */
  ascents(route: string): OwnAscent[] {
    return this.byRoute.get(route) ?? [];
  }

  opinion(route: string): OpinionIn | null {
    const waits = this.entered.find((item) => item.what === "opinion" && item.route === route);
    if (waits?.what === "opinion") return waits.body;
    return this.known.data?.opinions.find((row) => row.route_id === route) as OpinionIn | undefined ?? null;
  }

  /** The best result on a route. */
  best(route: string): Kind | null {
    const kinds = new Set(this.ascents(route).map(({ kind }) => kind));
    return KINDS.find((kind) => kinds.has(kind)) ?? null;
  }

  isDone(route: string): boolean {
    const best = this.best(route);
    return best !== null && TOPS.includes(best);
  }

  isProject(route: string): boolean {
    return !this.isDone(route) && this.ascents(route).some(({ kind }) => kind === "project");
  }

  private gather(): Map<string, OwnAscent[]> {
    const rows = new Map<string, OwnAscent>();
    for (const row of this.known.data?.ascents ?? []) {
      if (row.route_id) rows.set(row.id, { ...row, route_id: row.route_id, waits: false, known: true });
    }
    for (const item of this.entered) {
      if (item.what !== "ascent" && item.what !== "ascents") continue;
      for (const { id, body } of item.what === "ascent" ? [item] : item.rows) {
        if (item.takenBack) rows.delete(id);
        else rows.set(id, { ...body, id, waits: item.done === null, known: item.known || item.sent > 0 });
      }
    }
    const latest = [...rows.values()].sort((a, b) => b.climbed_at.localeCompare(a.climbed_at));
    return grouped(latest);
  }
}

function grouped(rows: OwnAscent[]): Map<string, OwnAscent[]> {
  const groups = new Map<string, OwnAscent[]>();
  for (const row of rows) groups.set(row.route_id, [...(groups.get(row.route_id) ?? []), row]);
  return groups;
}

function isLogged({ what }: Item): boolean {
  return what === "ascent" || what === "ascents" || what === "opinion";
}

/** Changes when the server has accepted an item of a gym's logbook, so that views reload. */
export function taken(gym: string): string {
  return acceptedKey(mine().filter((item) => item.gym === gym && isLogged(item)));
}

/** Filled for members; empty for others. */
export function logbook(gym: () => string, isMember: () => boolean): Logbook {
  const known = loadingKept<Schemas["LogbookOut"]>(async (how) => {
    const [slug, person, requested] = [gym(), me()?.id, Date.now()];
    void taken(slug);
    if (!person || !isMember()) return NONE;
    const facts = await answer(api.GET("/api/v1/gyms/{gym}/logbook", { params: { path: { gym: slug } }, ...how }));
    // Afterwards, as the page would show the older state for a moment.
    if (!how.cache && !offlineSince()) void settle(requested, (item) => isLogged(item) && item.gym === slug && item.person === person);
    return facts;
  });
  return new Logbook(gym, known);
}
