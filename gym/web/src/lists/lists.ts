/** Requests for lists of routes and problems, and their addresses. */

import { answer, api, type Schemas } from "../api/client";
import { t } from "../i18n.svelte";
import { colourName } from "../lib/colours";
import { p } from "../routes";

export type ClimbList = Schemas["ListOut"];
export type ListItem = Schemas["ListItem"];
export type ListIn = Omit<Schemas["NewList"], "edit">;

export const SHARES = ["private", "link", "gym"] as const;

export async function readList(gym: string, list: string, how: object = {}): Promise<ClimbList> {
  return answer(api.GET("/api/v1/gyms/{gym}/lists/{list_id}", { params: { path: { gym, list_id: list } }, ...how }));
}

export async function storeList(gym: string, list: string, body: ListIn): Promise<ClimbList> {
  return answer(api.PUT("/api/v1/gyms/{gym}/lists/{list_id}", { params: { path: { gym, list_id: list } }, body }));
}

/** The fields that a list's author sends to store it again. */
export function wordsOf({ name, note, share, circuit, items }: ClimbList): ListIn {
  return { name, note, share, circuit, items: items.map(({ id }) => id) };
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
