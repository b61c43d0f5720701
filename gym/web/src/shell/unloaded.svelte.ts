/**
 * The page whose script did not load: reception was lost, or the server has been updated since. The router would
 * wait for it for ever (sv-router 0.16), as if nobody had tapped.
 */

import { serializeSearch, type Routes } from "sv-router";

let opening = "";
let address = $state("");

/** The address of that page; empty if all is well. */
export const unloaded = () => address;

/** Called by the router around each page that it opens, not for scripts that it loads in advance. */
export const pageHooks: Routes["hooks"] = {
  beforeLoad: ({ pathname, search, hash }) => { opening = pathname + (serializeSearch(search) ?? "") + (hash ?? ""); },
  afterLoad: () => { opening = ""; },
};

window.addEventListener("vite:preloadError", () => { address = opening; });
