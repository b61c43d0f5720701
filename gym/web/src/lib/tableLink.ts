/** The address of a CSV export, with the separator and decimal sign that spreadsheets of the reader's country expect. */

import { locale } from "../i18n.svelte";

export function tableLink(path: string, query: Record<string, string> = {}): string {
  return `${path}.csv?${new URLSearchParams({ ...query, language: locale() }).toString()}`;
}
