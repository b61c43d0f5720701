/** The text of a table that a spreadsheet saved: UTF-8, UTF-16, or the Windows code page of the reader's language. */

import { language } from "../i18n.svelte";

const CENTRAL_EUROPE = "windows-1250";
const WESTERN_EUROPE = "windows-1252";

export async function tableText(file: Blob): Promise<string> {
  return decoded(new Uint8Array(await file.arrayBuffer()), language() === "cs" ? CENTRAL_EUROPE : WESTERN_EUROPE);
}

function decoded(bytes: Uint8Array, codePage: string): string {
  const [first, second] = bytes;
  if (first === 0xff && second === 0xfe) return new TextDecoder("utf-16le").decode(bytes);
  if (first === 0xfe && second === 0xff) return new TextDecoder("utf-16be").decode(bytes);
  try {
    return new TextDecoder("utf-8", { fatal: true }).decode(bytes);
  } catch {
    return new TextDecoder(codePage).decode(bytes);
  }
}
