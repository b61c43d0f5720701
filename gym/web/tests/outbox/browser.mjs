// What a browser gives the outbox, without one: its database in memory (fake-indexeddb), locks over all tabs, a clock that
// the tests turn. `tab()` opens a further tab.

import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { IDBFactory } from "fake-indexeddb";
import { build } from "vite";

const Channel = globalThis.BroadcastChannel;
const channels = [];
// Node waits for channels that are open.
globalThis.BroadcastChannel = class extends Channel {
  constructor(name) {
    super(name);
    this.unref();
    channels.push(this);
  }
};

/** Web Locks, as far as the outbox uses them: who asks for a name waits until all before are done. */
class Locks {
  #last = new Map();

  request(name, act) {
    const before = this.#last.get(name) ?? Promise.resolve();
    const mine = before.then(act);
    this.#last.set(name, mine.catch(() => undefined));
    return mine;
  }
}

async function bundled() {
  const folder = mkdtempSync(join(tmpdir(), "outbox-"));
  const input = fileURLToPath(new URL("tab.ts", import.meta.url));
  await build({
    configFile: false,
    logLevel: "error",
    build: { target: "es2022", outDir: folder, minify: false, lib: { entry: input, formats: ["es"], fileName: () => "tab.mjs" } },
  });
  return pathToFileURL(join(folder, "tab.mjs")).href;
}

const address = await bundled();
const realNow = Date.now;
let tabs = 0;

/** A browser that was never here before. `locks`: whether it has Web Locks. */
export function newBrowser({ locks = true } = {}) {
  for (const channel of channels.splice(0)) channel.close(); // of the one before
  globalThis.indexedDB = new IDBFactory();
  // Node's own, where it has one, can only be hidden.
  Object.defineProperty(globalThis, "navigator", { value: locks ? { locks: new Locks() } : {}, configurable: true });
  let time = realNow();
  Date.now = () => (time += 1);
  return {
    tab: () => import(`${address}?tab=${tabs++}`),
    /** Turn the clock, by ms. */
    turn: (ms) => (time += ms),
  };
}

/** Until whatever is ready to run has run. */
export const breath = () => new Promise((resolve) => setImmediate(resolve));
