/** The server's API, as its OpenAPI document has it. `schema.d.ts` is generated: `npm run api`. */

import createClient from "openapi-fetch";
import { said, t } from "../i18n.svelte";
import { heard, isCutOff, lost } from "../offline/reception.svelte";
import type { components, paths } from "./schema";

export type Schemas = components["schemas"];

export const PREFIX = "/api/v1";

export const api = createClient<paths>({ baseUrl: location.origin });

api.use({
  onResponse({ request, response }) {
    const kept = response.headers.get("x-walltopo-kept");
    if (request.cache === "only-if-cached") {
      if (kept && isCutOff()) lost(new Date(kept));
    } else if (kept) lost(new Date(kept));
    else heard();
  },
  onError({ request, error }) {
    if (request.cache !== "only-if-cached" && error instanceof TypeError) lost();
  },
});

type Told = { title: unknown; hint?: unknown; code?: unknown; hint_code?: unknown; values?: Record<string, string> };

/** Why something was not done: the server's words, or ours where it could not be reached. */
export class Problem extends Error {
  constructor(
    readonly status: number,
    message: string,
    readonly hint = "",
    /** What it is, for programs: the same in each language. */
    readonly code = "",
  ) {
    super(message);
  }

  static of(error: unknown): Problem {
    if (error instanceof Problem) return error;
    if (error instanceof TypeError) return Problem.unreachable();
    throw error;
  }

  static unreachable(): Problem {
    return new Problem(0, t("problem.unreachable"), t("problem.unreachableHint"));
  }

  /** Of an answer's body, which is `application/problem+json` (RFC 9457) unless a proxy wrote it. */
  static from(status: number, body: unknown): Problem {
    if (typeof body === "object" && body !== null && "title" in body) {
      const { title, hint, code, hint_code, values } = body as Told;
      const text = (key: unknown, english: unknown): string =>
        said(String(key ?? ""), values ?? {}) ?? (typeof english === "string" ? english : "");
      return new Problem(status, text(code, title), text(hint_code, hint), String(code ?? ""));
    }
    return new Problem(status, t("problem.status", { status }));
  }
}

/** What the server answered. Throws a `Problem` where it did not do it. */
export async function answer<T>(asked: Promise<{ data?: T; error?: unknown; response: Response }>): Promise<T> {
  let told;
  try {
    told = await asked;
  } catch (error) {
    throw Problem.of(error);
  }
  if (!told.response.ok) throw Problem.from(told.response.status, told.error);
  return told.data as T;
}
