/** An inspection as this browser knows it: the server's entries, and the marks that wait here. */

import { answer, api, type Schemas } from "../api/client";
import { loadingKept, type Loaded } from "../lib/loaded.svelte";
import { offlineSince } from "../offline/reception.svelte";
import { mine, say } from "../outbox/outbox.svelte";
import { acceptedKey, settle, type InspectionMarkIn, type Item } from "../outbox/store";
import { me } from "../session.svelte";

export type Inspection = Schemas["InspectionFull"];
export type Entry = Schemas["InspectionEntryOut"];
export type Level = Inspection["level"];

export const LEVELS: readonly Level[] = ["visual", "operational", "annual"];
export const ITEM_MARKS = ["fine", "defect", "unchecked"] as const;
export const HOLD_MARKS = ["fine", "tightened", "washed", "removed"] as const;
export const RESULTS = ["passed", "defects", "closed"] as const;

/** `waits`: the server has not accepted it yet. */
export type Mark = Pick<Entry, "wall_id" | "item" | "hold" | "mark" | "note" | "photo" | "at" | "by"> & { id: string; waits: boolean };

/** The place of a mark: an item of the checklist or a hold, at a wall. */
type Place = Pick<Mark, "wall_id"> & { item?: number | null; hold?: number | null };

const keyOf = ({ wall_id, item, hold }: Place): string => `${wall_id} ${item ?? ""} ${hold ?? ""}`;

export class Round {
  readonly loaded: Loaded<Inspection>;
  private readonly waitingHere = $derived.by(() => mine().filter((item) => this.isOurs(item)));
  private readonly all = $derived.by(() => this.gather());
  private readonly latest = $derived(new Map(this.all.map((mark) => [keyOf(mark), mark])));

  constructor(private readonly gym: () => string, private readonly id: () => string) {
    this.loaded = loadingKept<Inspection>(async (how) => {
      const [slug, inspection, person, requested] = [this.gym(), this.id(), me()?.id, Date.now()];
      void acceptedKey(mine().filter((item) => this.isOurs(item)));
      const facts = await answer(api.GET("/api/v1/gyms/{gym}/inspections/{inspection}", { params: { path: { gym: slug, inspection } }, ...how }));
      if (!how.cache && !offlineSince()) {
        void settle(requested, (item) => item.what === "inspection" && item.inspection === inspection && item.person === person);
      }
      return facts;
    });
  }

  /** Number of marks that the server has not accepted yet. */
  get waiting(): number {
    return this.waitingHere.filter(({ done, refused }) => done === null && !refused).length;
  }

  /** Number of marks that the server refused. They count here until their author decides. */
  get refused(): number {
    return this.waitingHere.filter(({ refused }) => refused).length;
  }

  mark(place: Place): Mark | undefined {
    return this.latest.get(keyOf(place));
  }

  /** The latest mark of each hold of a wall, by the hold's number. */
  holds(wall: string): (Mark & { hold: number })[] {
    const marked = [...this.latest.values()].flatMap((mark) => (mark.wall_id === wall && mark.hold != null ? [{ ...mark, hold: mark.hold }] : []));
    return marked.sort((a, b) => a.hold - b.hold);
  }

  get hasDefect(): boolean {
    return [...this.latest.values()].some(({ mark }) => mark === "defect");
  }

  async say(body: InspectionMarkIn, name: string, photo: Blob | null = null): Promise<void> {
    const person = me()?.id;
    if (!person) return;
    await say({ what: "inspection", id: crypto.randomUUID(), person, gym: this.gym(), name, inspection: this.id(), body, photo });
  }

  private isOurs(item: Item): boolean {
    return item.what === "inspection" && item.inspection === this.id();
  }

  private gather(): Mark[] {
    const known: Mark[] = (this.loaded.data?.entries ?? []).filter(({ late }) => !late).map((entry) => ({ ...entry, waits: false }));
    const ids = new Set(this.loaded.data?.entries.map(({ id }) => id));
    const here = this.waitingHere.flatMap((item): Mark[] => {
      if (item.what !== "inspection" || ids.has(item.id)) return [];
      const { id, at, body, done } = item;
      return [{ ...body, id, photo: null, at: new Date(at).toISOString(), by: me()?.name ?? "", waits: done === null }];
    });
    return this.loaded.data?.finished_at ? known : [...known, ...here];
  }
}
