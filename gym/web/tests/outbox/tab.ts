/** One tab's view of the outbox: each import after a reset of the modules has its own memory, as a tab has. */

export { nextEdit } from "../../src/outbox/edits";
export { send } from "../../src/outbox/send";
export { all, keep, keyOf, revise, settle, withdraw } from "../../src/outbox/store";
export { change } from "../../src/outbox/tick";
