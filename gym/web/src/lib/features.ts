/** The optional features of this server (its pages name them in their head) and of each gym. */

import type { Schemas } from "../api/client";

export type Feature = Schemas["GymOut"]["features_off"][number];

/** A feature, and the pages of a gym that belong to it. */
const PAGES: Record<Feature, RegExp> = {
  clips: /(?!)/, // clips and films have no pages of their own
  competitions: /^\/g\/[^/]+\/competitions(\/|$)/,
  films: /(?!)/,
  hall: /^\/g\/[^/]+\/settings\/hall(\/|$)/,
  insights: /^\/g\/[^/]+\/insights(\/|$)/,
  inspections: /^\/g\/[^/]+\/inspections(\/|$)/,
};

export const FEATURES = Object.keys(PAGES) as Feature[];

const named = document.querySelector<HTMLMetaElement>('meta[name="features"]')?.content;

/** Whether a feature is on. Pages of `npm run dev` name none: there all are on. */
export function has(feature: Feature): boolean {
  return named === undefined || named.split(" ").includes(feature);
}

type Gym = Pick<Schemas["GymOut"], "features_off" | "features_barred">;

/** The features that the gym or an operator has turned off; a stored answer of an older version has no barred ones. */
const allOff = (gym: Gym): Feature[] => [...gym.features_off, ...(gym.features_barred ?? [])];

/** Whether a gym has a feature; false until the gym is loaded. */
export function hasIn(gym: Gym | undefined, feature: Feature): boolean {
  return has(feature) && gym !== undefined && !allOff(gym).includes(feature);
}

/** Whether an address belongs to a feature that its gym has turned off. */
export function isOff(gym: Gym | undefined, pathname: string): boolean {
  return (gym ? allOff(gym) : []).some((feature) => PAGES[feature].test(pathname));
}
