/** The files that were dropped onto the page, those in dropped folders too. */

/** Call it while the event is handled: the browser forgets the items afterwards. */
export function droppedFiles(data: DataTransfer | null): Promise<File[]> {
  const entries = [...(data?.items ?? [])].map((item) => item.webkitGetAsEntry()).filter((entry) => entry !== null);
  const plain = [...(data?.files ?? [])];
  return entries.length ? Promise.all(entries.map(filesOf)).then((found) => found.flat()) : Promise.resolve(plain);
}

async function filesOf(entry: FileSystemEntry): Promise<File[]> {
  if (entry.name.startsWith(".")) return [];
  if (entry.isFile) {
    const file = await new Promise<File | null>((resolve) => (entry as FileSystemFileEntry).file(resolve, () => resolve(null)));
    return file ? [file] : [];
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  const inside: FileSystemEntry[] = [];
  for (;;) {
    // A browser gives at most a hundred entries at a time.
    const next = await new Promise<FileSystemEntry[]>((resolve) => reader.readEntries(resolve, () => resolve([])));
    if (next.length === 0) break;
    inside.push(...next);
  }
  return (await Promise.all(inside.map(filesOf))).flat();
}
