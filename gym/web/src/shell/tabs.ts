/** The main places: at the bottom of a phone, on top of a larger screen. */

import type { Key } from "../i18n.svelte";
import { p } from "../routes";

export interface Tab {
  label: Key;
  href: string;
  /** Addresses that belong to it. */
  at: RegExp;
  /** Path of its picture, 24 by 24, drawn as lines. */
  icon: string;
}

/** From left to right; the first one whose addresses match is the present one. */
export function tabs(gym: string, signedIn: boolean): Tab[] {
  const me: Tab = {
    label: signedIn ? "bar.me" : "account.signIn",
    href: signedIn ? p("/me") : p("/sign-in"),
    at: /^\/(me|people|sign-in|sign-up|new-password)(\/|$)/,
    icon: "M12 12a4 4 0 1 0 0-8 4 4 0 0 0 0 8ZM4 21c.6-4 3.8-6 8-6s7.4 2 8 6",
  };
  const walls: Tab = {
    label: "bar.walls",
    href: gym ? p("/g/:gym", { params: { gym } }) : p("/"),
    at: /^\/(g\/.*)?$/,
    icon: "M4 21 8 3h8l4 18M9 17l4-4-3-4 3-4",
  };
  if (!gym || !signedIn) return [walls, me];
  const progress: Tab = {
    label: "bar.progress",
    href: p("/g/:gym/progress", { params: { gym } }),
    at: /^\/g\/[^/]+\/(progress|sessions|feed)(\/|$)/,
    icon: "M4 20h16M6 20v-6m4 6V9m4 11v-4m4 4V4",
  };
  const board: Tab = {
    label: "bar.board",
    href: p("/g/:gym/board", { params: { gym } }),
    at: /^\/g\/[^/]+\/board$/,
    icon: "M7 4h10v5a5 5 0 0 1-10 0V4ZM7 6H4c0 3 1 4 3 4m10-4h3c0 3-1 4-3 4m-5 4v4m-4 2h8",
  };
  return [walls, progress, board, me];
}
