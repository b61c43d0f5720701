/** The words for what a competition consists of. */

import { t, type Key } from "../i18n.svelte";
import { colourName } from "../lib/colours";

/** A problem's name: its label, and the route's name or colour. */
export function problemName({ label, name, colour }: { label: string; name: string; colour: string }): string {
  return [label, name || (colour && colourName(colour))].filter(Boolean).join(" · ");
}

/** A text of an extensible kind: its code if there is no translation. */
export function known(prefix: string, code: string): string {
  const key = `comp.${prefix}.${code}` as Key;
  const text = t(key);
  return text === key ? code : text;
}
