/** The gym that was looked at last: the app opens there, and the bar's places are its. */

import { answer, api, type Schemas } from "../api/client";
import { Loaded, loadingKept } from "../lib/loaded.svelte";
import { keepGym } from "../offline/keepGym";
import { part } from "../routes";

const KEPT = "walltopo-last-gym";

let slug = $state(localStorage.getItem(KEPT) ?? "");

export function lastGym(): string {
  return slug;
}

function remember(gym: string): void {
  slug = gym;
  if (gym) localStorage.setItem(KEPT, gym);
  else localStorage.removeItem(KEPT);
}

/** The gym of the present address, which is the last one from now on; one that is not there (any more) no longer is. */
export function presentGym(): Loaded<Schemas["GymFacts"]> {
  const gym = loadingKept((how) => answer(api.GET("/api/v1/gyms/{gym}", { params: { path: { gym: part("gym") } }, ...how })));
  $effect(() => {
    if (gym.problem?.status === 404 && part("gym") === slug) remember("");
    else if (gym.data && !gym.problem) {
      remember(gym.data.slug);
      void keepGym(gym.data.slug, gym.data.role !== "guest");
    }
  });
  return gym;
}
