/** The words of competitions, in their own files: they come with these pages and no others. */

import { addWords, t, type Key } from "../i18n.svelte";
import { colourName } from "../lib/colours";

await addWords(import.meta.glob<object>("./locales/*.json", { import: "default" }));

/** What a problem is called: its label, and the route's name or colour. */
export function problemName({ label, name, colour }: { label: string; name: string; colour: string }): string {
  return [label, name || (colour && colourName(colour))].filter(Boolean).join(" · ");
}

/** A text of a kind that the server may add to: its code where there are no words for it. */
export function known(prefix: string, code: string): string {
  const key = `comp.${prefix}.${code}` as Key;
  const text = t(key);
  return text === key ? code : text;
}
