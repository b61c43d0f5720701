/** The gym of the present address, and the last visited one: the app opens there, and the bar's links lead to it. */

import { getContext, setContext, untrack } from "svelte";
import { answer, api, type Schemas } from "../api/client";
import { Loaded } from "../lib/loaded.svelte";
import { followGym } from "../lib/units.svelte";
import { keepGym } from "../offline/keepGym";
import { returned } from "../offline/reception.svelte";
import { route } from "../routes";

type Gym = Loaded<Schemas["GymOut"]>;

const KEPT = "walltopo-last-gym";
const SHARED = Symbol("gym");

let slug = $state(localStorage.getItem(KEPT) ?? "");

export function lastGym(): string {
  return slug;
}

function remember(gym: string): void {
  slug = gym;
  if (gym) localStorage.setItem(KEPT, gym);
  else localStorage.removeItem(KEPT);
}

/** The gym of the present address; empty on pages of no gym, in frames of other pages and on a hall's screen. */
function gymHere(): string {
  return /^\/g\//.test(route.pathname) ? (route.params.gym ?? "") : "";
}

/** Load the gym of each address for the whole page (`presentGym`) and store it as the last one; a missing gym is forgotten. */
export function provideGym(): Gym {
  const gym: Gym = new Loaded((how) => answer(api.GET("/api/v1/gyms/{gym}", { params: { path: { gym: gymHere() } }, ...how })));
  // Reset before the page is drawn, so that it never shows another gym's facts.
  $effect.pre(() => {
    const here = gymHere();
    untrack(() => {
      if (gym.data?.slug === here) return;
      gym.data = undefined;
      gym.problem = null;
    });
  });
  $effect(() => {
    void returned();
    void route.pathname;
    if (gymHere()) void gym.beginKept();
  });
  $effect(() => {
    if (gym.problem?.status === 404 && gymHere() === slug) remember("");
    else if (gym.data && !gym.problem) {
      remember(gym.data.slug);
      followGym(gym.data.units);
      keepGym(gym.data.slug, gym.data.role !== "guest");
    }
  });
  return setContext(SHARED, gym);
}

/** The gym of the present address, as the whole page has it. */
export function presentGym(): Gym {
  return getContext<Gym>(SHARED);
}
