/** The requests of these pages, one function each. */

import { answer, api, type Schemas } from "../api/client";
import type { Language } from "../i18n.svelte";
import type { How } from "../lib/loaded.svelte";
import { part } from "../routes";
import type { Board } from "./facts";

const BASE = "/api/v1/gyms/{gym}/competitions";
const OF = "/api/v1/gyms/{gym}/competitions/{competition}";

/** Gym and competition of the present address. */
export function here(): { gym: string; competition: string } {
  return { gym: part("gym"), competition: part("competition") };
}

type Here = ReturnType<typeof here>;

export const competitions = (gym: string, how: How = {}) => answer(api.GET(BASE, { params: { path: { gym } }, ...how }));
export const makeCompetition = (gym: string, body: Schemas["NewCompetition"]) => answer(api.POST(BASE, { params: { path: { gym } }, body }));
export const sheet = (path: Here, how: How = {}) => answer(api.GET(OF, { params: { path }, ...how }));
export const change = (path: Here, body: Schemas["CompetitionIn"]) => answer(api.PATCH(OF, { params: { path }, body }));
export const drop = (path: Here) => answer(api.DELETE(OF, { params: { path } }));
export const putSheet = (path: Here, body: Schemas["SheetBody"]) => answer(api.PUT(`${OF}/sheet`, { params: { path }, body }));
export const putState = (path: Here, state: Schemas["StateBody"]["state"]) => answer(api.PUT(`${OF}/state`, { params: { path }, body: { state } }));
export const freeze = (path: Here, frozen: boolean) => answer(api.PUT(`${OF}/frozen`, { params: { path }, body: { frozen } }));
export const putRound = (path: Here, round: string, state: Schemas["RoundStateBody"]["state"]) =>
  answer(api.PUT(`${OF}/rounds/{one}/state`, { params: { path: { ...path, one: round } }, body: { state } }));
export const starters = (path: Here, round: string, how: How = {}) =>
  answer(api.GET(`${OF}/rounds/{one}/starters`, { params: { path: { ...path, one: round } }, ...how }));

export const putStarters = (path: Here, round: string, body: Schemas["OrderBody"]) =>
  answer(api.PUT(`${OF}/rounds/{one}/starters`, { params: { path: { ...path, one: round } }, body }));
export const drawStarters = (path: Here, round: string) =>
  answer(api.POST(`${OF}/rounds/{one}/starters/draw`, { params: { path: { ...path, one: round } } }));

export const entries = (path: Here, how: How = {}) => answer(api.GET(`${OF}/entries`, { params: { path }, ...how }));
export const addEntry = (path: Here, body: Schemas["EntryBody"]) => answer(api.POST(`${OF}/entries`, { params: { path }, body }));
export const changeEntry = (path: Here, entry: string, body: Schemas["EntryChange"]) =>
  answer(api.PATCH(`${OF}/entries/{entry}`, { params: { path: { ...path, entry } }, body }));
export const importEntries = (path: Here, csv: string, really: boolean, others: number[] = []) =>
  answer(api.POST(`${OF}/entries/import`, { params: { path }, body: { csv, really, others } }));
export const signWaiver = (path: Here, entry: string, signed_by: string) =>
  answer(api.POST(`${OF}/entries/{entry}/waiver`, { params: { path: { ...path, entry } }, body: { signed_by } }));

export const mine = (path: Here, how: How = {}) => answer(api.GET(`${OF}/mine`, { params: { path }, ...how }));
export const enter = (path: Here, body: Schemas["OwnEntryBody"]) => answer(api.PUT(`${OF}/mine`, { params: { path }, body }));
export const withdrawEntry = (path: Here) => answer(api.DELETE(`${OF}/mine`, { params: { path } }));

export const marks = (path: Here, problem: string, how: How = {}) =>
  answer(api.GET(`${OF}/problems/{problem}/marks`, { params: { path: { ...path, problem } }, ...how }));
/** The competitors who are out of the ranking: the counting events that say so. */
export async function outs(path: Here): Promise<Schemas["EventOut"][]> {
  const found = [];
  for (let after: number | null = 0; after !== null; ) {
    const page: Schemas["EventPage"] = await answer(api.GET(`${OF}/events`, { params: { path, query: { kind: "out", after, size: 200 } } }));
    found.push(...page.items.filter(({ counts }) => counts));
    after = page.next ?? null;
  }
  return found;
}
export const judgeLinks = (path: Here, how: How = {}) => answer(api.GET(`${OF}/judge-links`, { params: { path }, ...how }));
export const makeJudgeLink = (path: Here, problem: string) =>
  answer(api.POST(`${OF}/problems/{problem}/judge-links`, { params: { path: { ...path, problem } } }));
export const revokeJudgeLink = (path: Here, link: string) =>
  answer(api.DELETE(`${OF}/judge-links/{link}`, { params: { path: { ...path, link } } }));
export const revokeJudgeLinks = (path: Here, round: string) =>
  answer(api.DELETE(`${OF}/rounds/{one}/judge-links`, { params: { path: { ...path, one: round } } }));
export const judgeSheet = (path: Here, round: string, query: { language: Language; size: "a4" | "letter" }) =>
  api.POST(`${OF}/rounds/{one}/judge-sheet`, { params: { path: { ...path, one: round }, query }, parseAs: "blob" });
export const openJudgeLink = (body: Schemas["OpenBody"]) => answer(api.POST("/api/v1/judge-links/open", { body }));
export const judgePad = (link: string, how: How = {}) => answer(api.GET("/api/v1/judge-links/{link}/pad", { params: { path: { link } }, ...how }));

export const appeals = (path: Here, how: How = {}) => answer(api.GET(`${OF}/appeals`, { params: { path }, ...how }));
export const board = async (path: Here, at?: string): Promise<Board> =>
  (await answer(api.GET(`${OF}/board`, { params: { path, query: at ? { at } : {} } }))) as Board;
export const why = (path: Here, first: string, second: string) =>
  answer(api.GET(`${OF}/board/why`, { params: { path, query: { first, second } } }));
