/** A clip and its attempt, as the pages show them. */

import { PREFIX, type Schemas } from "../api/client";
import { t } from "../i18n.svelte";

export type Clip = Schemas["ClipOut"];
export type Attempt = Schemas["ClipAttempt"];
export type Move = Attempt["moves"][number];

const PATIENCE_MS = 3000;

export function isPending({ state }: Clip): boolean {
  return state === "sent" || state === "reading";
}

/** A hold by its number among the route's holds, from the lowest on; of another route without one. */
export function holdName(number: number | null | undefined): string {
  return number == null ? t("clips.otherHold") : t("clips.hold", { number });
}

/** The address of a clip's film. */
export function filmAddress(gym: string, clip: string): string {
  return `${PREFIX}/gyms/${gym}/clips/${clip}/film`;
}

/** The address of a clip's moves; another one once they are confirmed. */
export function movesAddress(gym: string, { id, confirmed }: Clip): string {
  return `${PREFIX}/gyms/${gym}/clips/${id}/moves.json?${confirmed ? "confirmed" : "read"}`;
}

export function isHand({ limb }: Pick<Move, "limb">): boolean {
  return limb.endsWith("hand");
}

/** How an attempt ended, and its number of moves of the hands after the start. */
export function outcomeOf({ start_s, top_s, fall_s }: Attempt, moves: readonly Pick<Move, "limb" | "time_s">[]): { how: "top" | "fall" | "end"; count: number } {
  const count = moves.filter((move) => isHand(move) && move.time_s > (start_s ?? -1)).length;
  if (top_s !== null && top_s !== undefined) return { how: "top", count };
  return { how: fall_s === null || fall_s === undefined ? "end" : "fall", count };
}

/** The length of a video in seconds; null if this browser cannot tell. */
export function secondsOf(file: File): Promise<number | null> {
  return new Promise((resolve) => {
    const video = document.createElement("video");
    const address = URL.createObjectURL(file);
    const end = (seconds: number | null): void => {
      URL.revokeObjectURL(address);
      resolve(seconds !== null && Number.isFinite(seconds) ? seconds : null);
    };
    video.preload = "metadata";
    video.onloadedmetadata = () => end(video.duration);
    video.onerror = () => end(null);
    setTimeout(() => end(null), PATIENCE_MS);
    video.src = address;
  });
}
