/** The words of the hall's pages, in their own files: they come with these pages and no others. */

import { addWords } from "../i18n.svelte";

await addWords(import.meta.glob<object>("./locales/*.json", { import: "default" }));
