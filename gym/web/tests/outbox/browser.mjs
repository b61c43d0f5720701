// The outbox's environment without a browser: a database in memory (fake-indexeddb), locks over all tabs, a clock that the tests
// turn. `tab()` opens another tab.

import { IDBFactory } from "fake-indexeddb";
import { vi } from "vitest";

const channels = [];

/** Messages between tabs, as far as the outbox uses them: in a later turn, and in the order of sending. Node's own come through
    another thread, in an order that no seed gives again. */
globalThis.BroadcastChannel = class extends EventTarget {
  constructor(name) {
    super();
    this.name = name;
    channels.push(this);
  }

  postMessage(data) {
    const others = channels.filter((other) => other !== this && other.name === this.name);
    setImmediate(() => others.forEach((other) => other.dispatchEvent(new MessageEvent("message", { data }))));
  }
};

/** Web Locks, as far as the outbox uses them: a request for a name waits until all before it are done. */
class Locks {
  #last = new Map();

  request(name, act) {
    const before = this.#last.get(name) ?? Promise.resolve();
    const mine = before.then(act);
    this.#last.set(name, mine.catch(() => undefined));
    return mine;
  }
}

const realNow = Date.now;

/** A new browser. `locks`: whether it has Web Locks. */
export function newBrowser({ locks = true } = {}) {
  channels.length = 0; // of the one before
  globalThis.indexedDB = new IDBFactory();
  // Node's own, where it has one, can only be hidden.
  Object.defineProperty(globalThis, "navigator", { value: locks ? { locks: new Locks() } : {}, configurable: true });
  let time = realNow();
  Date.now = () => (time += 1);
  return {
    tab: () => {
      vi.resetModules();
      return import("./tab");
    },
    /** Turn the clock, by ms. */
    turn: (ms) => (time += ms),
  };
}

/** Run everything that is ready to run. */
export const breath = () => new Promise((resolve) => setImmediate(resolve));
