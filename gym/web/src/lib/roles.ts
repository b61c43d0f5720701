/** What one may do in a gym; the server decides, this only spares buttons that would be refused. */

import type { Schemas } from "../api/client";

type Gym = Schemas["GymFacts"];

export function isSetter(gym: Gym | undefined): boolean {
  return gym?.role === "setter" || gym?.role === "owner";
}

export function isJudge(gym: Gym | undefined): boolean {
  return gym?.role === "judge" || isSetter(gym);
}

export function isOwner(gym: Gym | undefined): boolean {
  return gym?.role === "owner";
}
