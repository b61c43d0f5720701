/** The server's API, as its OpenAPI document has it. `schema.d.ts` is generated: `npm run api`. */

import createClient from "openapi-fetch";
import { problemsKnown, problemText, t } from "../i18n.svelte";
import { isPortal } from "../offline/portal";
import { heard, isCutOff, lost } from "../offline/reception.svelte";
import type { components, paths } from "./schema";

export type Schemas = components["schemas"];

export const PREFIX = "/api/v1";

let unsigned = (): void => {};

/** Call this whenever the server answers that nobody is signed in. */
export function whenUnsigned(listener: () => void): void {
  unsigned = listener;
}

export const api = createClient<paths>({ baseUrl: location.origin });

api.use({
  onResponse({ request, response }) {
    const kept = response.headers.get("x-walltopo-kept");
    if (request.cache === "only-if-cached") {
      if (kept && isCutOff()) lost(new Date(kept));
    } else if (kept) lost(new Date(kept));
    else if (isPortal(response)) {
      lost();
      throw new TypeError("a captive portal answered");
    } else heard();
    if (response.status === 401 && !kept) unsigned();
  },
  onError({ request, error }) {
    if (request.cache !== "only-if-cached" && error instanceof TypeError) lost();
  },
});

type Message = { title: unknown; hint?: unknown; code?: unknown; hint_code?: unknown; values?: Record<string, string> };

/** Why a request failed: the server's sentence, or ours if the server could not be reached. */
export class ApiError extends Error {
  constructor(
    readonly status: number,
    message: string,
    readonly hint = "",
    /** The code of the error, the same in each language. */
    readonly code = "",
  ) {
    super(message);
  }

  static of(error: unknown): ApiError {
    if (error instanceof ApiError) return error;
    if (error instanceof TypeError) return ApiError.unreachable();
    throw error;
  }

  static unreachable(): ApiError {
    return new ApiError(0, t("problem.unreachable"), t("problem.unreachableHint"));
  }

  /** Reads a response's body, which is `application/problem+json` (RFC 9457) unless a proxy wrote it. */
  static from(status: number, body: unknown): ApiError {
    if (typeof body === "object" && body !== null && "title" in body) {
      const { title, hint, code, hint_code, values } = body as Message;
      const text = (key: unknown, english: unknown): string =>
        problemText(String(key ?? ""), values ?? {}) ?? (typeof english === "string" ? english : "");
      return new ApiError(status, text(code, title), text(hint_code, hint), String(code ?? ""));
    }
    return new ApiError(status, t("problem.status", { status }));
  }
}

/** Returns the server's response. Throws a `ApiError` if the request failed. */
export async function answer<T>(requested: Promise<{ data?: T; error?: unknown; response: Response }>): Promise<T> {
  let result;
  try {
    result = await requested;
  } catch (error) {
    throw ApiError.of(error);
  }
  if (!result.response.ok) {
    await problemsKnown();
    throw ApiError.from(result.response.status, result.error);
  }
  return result.data as T;
}
