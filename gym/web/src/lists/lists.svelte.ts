/** A gym's lists of routes and problems: those of the server, and one's own that wait here. */

import { answer, api, type Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import { colourName } from "../lib/colours";
import { loadingKept, type Loaded } from "../lib/loaded.svelte";
import { LISTS_SHOWN } from "../offline/keepGym";
import { offlineSince } from "../offline/reception.svelte";
import { mine, say } from "../outbox/outbox.svelte";
import { acceptedKey, settle, type Item, type ListIn } from "../outbox/store";
import { p } from "../routes";
import { me } from "../session.svelte";

export type { ListIn } from "../outbox/store";
export type ListItem = Schemas["ListItem"];
type Facts = Schemas["ListSummary"];
/** `waits`: the server may not have it, or not as it is now. */
export type ClimbList = Facts & { waits: boolean };

export const SHARES = ["private", "link", "gym"] as const;

/** A list that its author has just begun. */
export const newList = (name: string, items: string[] = []): ListIn => ({ name, note: "", share: "private", circuit: false, items });

/** The fields of a list that its author can change. */
export function wordsOf({ name, note, share, circuit, climbs }: Facts): ListIn {
  return { name, note, share, circuit, items: climbs };
}

export class GymLists {
  readonly first: Loaded<Facts[]>;
  private readonly entered = $derived.by(() => mine().filter((item) => item.what === "list" && item.gym === this.gym() && !item.refused));
  readonly rows = $derived.by(() => this.gather());
  readonly own = $derived(this.rows.filter((row) => row.author_id === me()?.id));

  /** People who are not members see no lists, only one that is shared by link. */
  constructor(
    private readonly gym: () => string,
    isMember: () => boolean,
  ) {
    this.first = loadingKept(async (how) => {
      const [slug, requested] = [gym(), Date.now()];
      void acceptedKey(this.entered);
      if (!isMember()) return [];
      const params = { path: { gym: slug }, query: { size: LISTS_SHOWN } };
      const page = await answer(api.GET("/api/v1/gyms/{gym}/lists", { params, ...how }));
      // Afterwards, as the page would show the older state for a moment.
      if (!how.cache && !offlineSince()) void settle(requested, (item) => item.what === "list" && item.gym === slug && item.person === me()?.id);
      return page.items;
    });
  }

  find(id: string): ClimbList | null {
    return this.rows.find((row) => row.id === id) ?? null;
  }

  /** Store a list; `before` is what is known of it. */
  async keep(id: string, words: ListIn, before: ClimbList | null): Promise<void> {
    await say({ what: "list", id, person: me()!.id, gym: this.gym(), name: words.name, body: words, takenBack: false, known: before !== null });
  }

  async drop(list: Facts): Promise<void> {
    await say({ what: "list", id: list.id, person: me()!.id, gym: this.gym(), name: list.name, body: wordsOf(list), takenBack: true, known: true });
  }

  private gather(): ClimbList[] {
    const rows = new Map((this.first.data ?? []).map((row): [string, ClimbList] => [row.id, { ...row, waits: false }]));
    for (const item of this.entered) {
      if (item.what !== "list") continue;
      if (item.takenBack) rows.delete(item.id);
      else rows.set(item.id, { ...made(item), ...rows.get(item.id), ...changed(item.body), waits: item.done === null });
    }
    return [...rows.values()].sort((a, b) => b.created_at.localeCompare(a.created_at));
  }
}

function changed({ name, note, share, circuit, items }: ListIn): Pick<Facts, "name" | "note" | "share" | "circuit" | "climbs"> {
  return { name, note, share, circuit, climbs: items };
}

/** A list that the server does not have yet. */
function made({ id, at, body }: Extract<Item, { what: "list" }>): Facts {
  const author = { author_id: me()?.id ?? null, author: me()?.name ?? "" };
  return { id, ...changed(body), ...author, climbed: 0, joined: false, shows_progress: false, hidden: false, created_at: new Date(at).toISOString() };
}

export async function readList(gym: string, list: string, how: object = {}): Promise<Schemas["ListOut"]> {
  return answer(api.GET("/api/v1/gyms/{gym}/lists/{list_id}", { params: { path: { gym, list_id: list } }, ...how }));
}

export function itemName(item: ListItem): string {
  return item.kind === "gone" ? t("lists.gone") : item.name || colourName(item.colour ?? "");
}

export const listAddress = (gym: string, list: string): string => p("/g/:gym/lists/:list", { params: { gym, list } });

/** The page of an item, from which one goes on to the next of the list; null: it is gone. */
export function itemAddress(gym: string, list: string, { kind, id, wall_id: wall }: ListItem): string | null {
  if (kind === "gone" || !wall) return null;
  const page = kind === "route" ? p("/g/:gym/w/:wall/r/:route", { params: { gym, wall, route: id } })
    : p("/g/:gym/w/:wall/problems/:problem", { params: { gym, wall, problem: id } });
  return `${page}?list=${list}`;
}
