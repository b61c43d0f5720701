/** Chosen photos and clips that are not sent yet, stored in this browser by the hash of their content: a closed tab loses none. */

import { createStore, del, entries, set, type UseStore } from "idb-keyval";

export interface Pending {
  hash: string;
  file: File;
}

let store: UseStore | undefined;

function kept(): UseStore {
  return (store ??= createStore("walltopo-photos", "pending"));
}

function key(owner: string, hash: string): string {
  return `${owner}/${hash}`;
}

/** SHA-256 of a file, in hex digits. */
export async function hashOf(file: Blob): Promise<string> {
  const digest = await crypto.subtle.digest("SHA-256", await file.arrayBuffer());
  return Array.from(new Uint8Array(digest), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** Store a photo until it is sent. Returns false if the browser lacks space; the photo is sent all the same. */
export async function keep(owner: string, { hash, file }: Pending): Promise<boolean> {
  try {
    await set(key(owner, hash), file, kept());
    return true;
  } catch {
    return false;
  }
}

export async function forget(owner: string, hash: string): Promise<void> {
  await del(key(owner, hash), kept()).catch(() => undefined);
}

/** The stored files of a scan or route that can still be read. */
export async function pendingOf(owner: string): Promise<Pending[]> {
  const all = await entries<string, File>(kept()).catch(() => []);
  const mine = all.filter(([name]) => name.startsWith(`${owner}/`));
  const readable = await Promise.all(
    mine.map(async ([name, file]) => {
      const hash = name.slice(owner.length + 1);
      // In some browsers the entry outlives its bytes.
      const whole = await file.slice(0, 1).arrayBuffer().then(() => true, () => false);
      if (!whole) await forget(owner, hash);
      return whole ? [{ hash, file }] : [];
    }),
  );
  return readable.flat();
}
