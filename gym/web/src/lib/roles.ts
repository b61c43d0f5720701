/** The viewer's rights in a gym. The server decides; this only hides buttons that it would refuse. */

import type { Schemas } from "../api/client";

type Gym = Schemas["GymOut"];

export function isSetter(gym: Gym | undefined): boolean {
  return gym?.role === "setter" || gym?.role === "owner";
}

export function isJudge(gym: Gym | undefined): boolean {
  return gym?.role === "judge" || isSetter(gym);
}

export function isOwner(gym: Gym | undefined): boolean {
  return gym?.role === "owner";
}
