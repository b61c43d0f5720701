/** What one tab has of the outbox: each import of it, bundled, has its own memory, as a tab has. */

export { nextEdit } from "../../src/outbox/edits";
export { send } from "../../src/outbox/send";
export { all, keep, keyOf, revise, settle, withdraw } from "../../src/outbox/store";
export { change } from "../../src/outbox/tick";
