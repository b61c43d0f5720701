/** Requests of the operator's pages: each may need a proof of the operator's identity. */

import { confirmed } from "../accounts/confirming.svelte";
import { answer } from "../api/client";
import { loading, type Loaded } from "../lib/loaded.svelte";

type Requested<T> = Parameters<typeof answer<T>>[0];

/** The answer of the server, asked again after the proof that it demands. */
export function asOperator<T>(request: () => Requested<T>): Promise<T> {
  return confirmed(() => answer(request()));
}

/** Data for an operator's page. */
export function loadingAsOperator<T>(request: () => Requested<T>): Loaded<T> {
  return loading(() => asOperator(request));
}
