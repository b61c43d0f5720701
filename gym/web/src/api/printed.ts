/** Documents that the server makes, for the reader to save. */

import { ApiError } from "./client";

/** A document to save. `missing`: characters that its font lacks. */
export interface Printed {
  url: string;
  name: string;
  missing: string;
}

/** The document of a response; `before`: the one that it replaces. Throws a `ApiError` if the request failed. */
export async function printed(requested: Promise<{ data?: Blob; error?: unknown; response: Response }>, before?: Printed): Promise<Printed> {
  let result;
  try {
    result = await requested;
  } catch (error) {
    throw ApiError.of(error);
  }
  const { data, error, response } = result;
  if (!data) throw ApiError.from(response.status, error);
  if (before) URL.revokeObjectURL(before.url);
  const name = /filename="([^"]+)"/.exec(response.headers.get("content-disposition") ?? "")?.[1] ?? "paper.pdf";
  return { url: URL.createObjectURL(data), name, missing: decodeURIComponent(response.headers.get("x-not-printed") ?? "") };
}
