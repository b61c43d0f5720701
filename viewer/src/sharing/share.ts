/** Passing a view on: its link, a picture of it, and the page's own address. */

import { say } from "../languages";
import { h } from "../panels/dom";
import { formatView } from "./view_link";
import type { LinkedView } from "./view_link";

/** Copies it, or puts it into the address bar. Gives what to tell. */
export async function copyLink(url: string): Promise<string> {
  try {
    await navigator.clipboard.writeText(url);
    return say().words.copied;
  } catch {
    // Without the clipboard (page from disk, old browser) the address itself is the link.
    history.replaceState(null, "", url);
    return say().words.inAddress;
  }
}

export function download(picture: Blob): void {
  const link = h("a", { href: URL.createObjectURL(picture), download: "wall.png" });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/** The address of this page with a place in it. */
export function linkTo(place: LinkedView): string {
  const url = new URL(location.href);
  url.searchParams.delete("token"); // who is shown a route need not be able to save
  url.hash = formatView(place);
  return url.href;
}

/** Keeps a place in the page's address, once it has stayed the same for a moment. */
export class AddressBar {
  private timer = 0;

  keep(place: () => LinkedView): void {
    clearTimeout(this.timer);
    this.timer = window.setTimeout(() => {
      history.replaceState(null, "", formatView(place()) || location.pathname + location.search);
    }, 300);
  }

  dispose(): void {
    clearTimeout(this.timer);
  }
}
