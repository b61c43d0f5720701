/** The facts of a gym that lists of routes need, and one filter for all of its walls. */

import { answer, api, type Schemas } from "../api/client";
import { colourName } from "../lib/colours";
import { loading, loadingKept, type Loaded } from "../lib/loaded.svelte";
import { logbook, taken, type Logbook } from "../outbox/logbook.svelte";
import { body } from "./body.svelte";
import { ALL, type Known, type Route, type Tally, type RouteFilter } from "./find";
import { lastVisit } from "./visits";

const SOON_DAYS = 14;
const DAY_MS = 86_400_000;
// The height that counts until the climber enters one.
const USUAL_M = 1.65;

/** It is kept between the gym's list and the wall. */
export const filter = $state<RouteFilter>({ ...ALL });

export class GymRoutes implements Known {
  readonly book: Logbook;
  private readonly systems: Loaded<Schemas["GradeSystemOut"][]>;
  private readonly tallies: Loaded<Tally[]>;
  private readonly alike: Loaded<Schemas["SimilarRoutes"] | null>;
  private readonly ranks = $derived.by(() => this.order());
  private readonly counts = $derived.by(() => new Map((this.tallies.data ?? []).map((tally) => [tally.route_id, tally])));
  private readonly before = $derived.by(() => lastVisit(this.gym()));

  constructor(
    private readonly gym: () => string,
    isMember: () => boolean,
    private readonly scans: () => Record<string, string | null>,
  ) {
    const path = () => ({ params: { path: { gym: gym() } } });
    this.systems = loadingKept((how) => answer(api.GET("/api/v1/gyms/{gym}/grade-systems", { ...path(), ...how })));
    this.tallies = loadingKept((how) => {
      void taken(gym());
      return answer(api.GET("/api/v1/gyms/{gym}/tallies", { ...path(), ...how }));
    });
    this.alike = loading((how) => {
      const params = { path: { gym: gym(), route: filter.like } };
      return filter.like ? answer(api.GET("/api/v1/gyms/{gym}/routes/{route}/similar", { params, ...how })) : Promise.resolve(null);
    });
    this.book = logbook(gym, isMember);
  }

  private order(): Map<string, number> {
    const labels = (this.systems.data ?? []).flatMap(({ id, grades }) => grades.map(({ label }) => `${id}|${label}`));
    return new Map(labels.map((key, place) => [key, place]));
  }

  /** The grades of a route's system, from the easiest. */
  labels(route: Route): string[] {
    return this.systems.data?.find(({ id }) => id === route.grade_system_id)?.grades.map(({ label }) => label) ?? [];
  }

  rank(route: Route): number {
    return this.ranks.get(`${route.grade_system_id}|${route.grade}`) ?? -1;
  }

  label(rank: number): string {
    const key = [...this.ranks].find(([, place]) => place === rank)?.[0] ?? "";
    return key.slice(key.indexOf("|") + 1);
  }

  tally(route: Route): Tally | undefined {
    return this.counts.get(route.id);
  }

  isNew(route: Route): boolean {
    return route.set_on >= this.before;
  }

  isSoon(route: Route): boolean {
    return Boolean(route.strip_on) && Date.parse(route.strip_on!) < Date.now() + SOON_DAYS * DAY_MS;
  }

  isDone(route: Route): boolean {
    return this.book.isDone(route.id);
  }

  isProject(route: Route): boolean {
    return this.book.isProject(route.id);
  }

  colourName(colour: string): string {
    return colourName(colour);
  }

  get height(): number {
    return body.height_cm === null ? USUAL_M : body.height_cm / 100;
  }

  /** The arm span in metres; null if the climber entered neither span nor height. */
  get span(): number | null {
    const span = body.reach_cm ?? body.height_cm;
    return span === null ? null : span / 100;
  }

  get similar(): string[] | undefined {
    return this.alike.data?.routes;
  }

  scanOf(wall: string): string | null {
    return this.scans()[wall] ?? null;
  }
}
