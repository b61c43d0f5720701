/** Sends what waits, from whichever tab or the service worker, one at a time (Web Locks). */

import { told as toldEdit } from "./edits";
import { all, keyOf, revise, type Item } from "./store";

const API = "/api/v1";
const PATIENCE_MS = 30_000;

/** "later": the server could not be reached or is busy; "sign-in": nobody is signed in who could send it. */
export type Outcome = "empty" | "later" | "sign-in";

class Unreachable extends Error {}

/** `person`: whose it is; the server refuses it (401) where somebody else is signed in by now. */
async function ask(method: string, path: string, person = "", body?: unknown): Promise<Response> {
  const headers: Record<string, string> = person ? { "x-walltopo-person": person } : {};
  if (body !== undefined) headers["content-type"] = "application/json";
  const sent = body === undefined ? undefined : JSON.stringify(body);
  try {
    // "no-store": this answer is the server's own, never a kept one.
    return await fetch(API + path, { method, headers, body: sent, cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
  } catch {
    throw new Unreachable();
  }
}

function isBusy({ status }: Response): boolean {
  return status >= 500 || [408, 425, 429].includes(status);
}

/** Puts it to the server. What was taken back is told first too: a late copy of it then finds that it is over. */
async function put(item: Item): Promise<Response> {
  if (item.what === "score") {
    // Both times are this device's: the server learns how wrong its clock is.
    const body = { ...item.body, sent_at: new Date().toISOString() };
    return ask("PUT", `/gyms/${item.gym}/competitions/${item.competition}/events/${item.id}`, item.person, body);
  }
  const body = item.edit ? { ...item.body, edit: toldEdit(item.edit) } : item.body;
  if (item.what === "opinion") return ask("PUT", `/gyms/${item.gym}/routes/${item.route}/opinion`, item.person, body);
  const told = await ask("PUT", `/gyms/${item.gym}/ascents/${item.id}`, item.person, body);
  return told.ok && item.takenBack ? ask("DELETE", `/me/ascents/${item.id}`, item.person) : told;
}

async function why(answer: Response): Promise<NonNullable<Item["refused"]>> {
  const told = (await answer.json().catch(() => ({}))) as { title?: string; hint?: string };
  return { status: answer.status, message: told.title ?? "", hint: told.hint ?? "" };
}

async function sendOne(item: Item): Promise<Outcome> {
  if (item.what === "ascent" && item.takenBack && item.sent === 0 && !item.known) {
    await revise(item, () => null); // it never left
    return "empty";
  }
  // Kept before it leaves: from now on the server may have it. The version stays, it says the same.
  if (!(await revise(item, (now) => ({ ...now, sent: now.sent + 1 })))) return "empty"; // it says something else now
  const answer = await put(item);
  if (answer.status === 401) return "sign-in";
  if (isBusy(answer)) return "later";
  const refused = answer.ok ? null : await why(answer);
  const done = answer.ok ? Date.now() : null;
  await revise(item, (now) => ({ ...now, done, refused }));
  return "empty";
}

async function whoIsHere(): Promise<string | Outcome> {
  const answer = await ask("GET", "/me");
  if (answer.ok) return ((await answer.json()) as { id: string }).id;
  return answer.status === 401 ? "sign-in" : "later";
}

async function sendWaiting(): Promise<Outcome> {
  const waiting = async () => (await all()).filter(({ done, refused }) => done === null && !refused);
  if ((await waiting()).length === 0) return "empty";
  const person = await whoIsHere();
  if (person === "later" || person === "sign-in") return person;
  let outcome: Outcome = "empty";
  const tried = new Set<string>();
  for (;;) {
    // Read again after each: more may have been said meanwhile.
    const rows = await waiting();
    const here = new Set(rows.map((item) => item.what === "score" && item.id));
    // What takes back an event comes after it.
    const isNext = (item: Item): boolean => item.what !== "score" || !here.has(item.body.target_id ?? "");
    const next = rows.find((item) => item.person === person && isNext(item) && !tried.has(`${keyOf(item)} ${item.version}`));
    if (!next) return outcome;
    tried.add(`${keyOf(next)} ${next.version}`);
    const came = await sendOne(next);
    if (came === "sign-in") return came;
    if (came === "later") outcome = "later"; // the others may get through
  }
}

/** Send all of the person who is signed in. */
export async function send(): Promise<Outcome> {
  const attempt = (): Promise<Outcome> =>
    sendWaiting().catch((error: unknown) => {
      if (error instanceof Unreachable) return "later";
      throw error;
    });
  return "locks" in navigator ? navigator.locks.request("walltopo-outbox", attempt) : attempt();
}
