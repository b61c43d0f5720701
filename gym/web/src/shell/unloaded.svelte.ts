/** The page whose script did not load: reception was lost, or the server has been updated since. */

import { serializeSearch, type Routes } from "sv-router";

let address = $state("");

/** The address of that page; empty if all is well. */
export const unloaded = () => address;

/** Called by the router. */
export const pageHooks: Routes["hooks"] = {
  onError: (_error, { pathname, search, hash }) => {
    address = pathname + (serializeSearch(search) ?? "") + (hash ?? "");
  },
};
