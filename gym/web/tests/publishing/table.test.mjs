// The table of a review: what was typed, and what the existing routes say.

import assert from "node:assert/strict";
import { test } from "vitest";
import { entriesOf, handRouteOf, identified, rowsOf } from "../../src/publishing/table.svelte";

const line = (number, route_id = null) => ({ number, route_id, fate: route_id ? "kept" : "new", colour: "red", came: [], went: [], moved: [], photographed: true });
const route = (id, facts = {}) => ({ id, number: null, name: "", grade: "", grade_system_id: null, setter: "", tags: [], strip_on: null, colour: "red", ...facts });

test("a new row becomes a route without a scan with what was typed", () => {
  const [row] = rowsOf([line(3)], [], []);
  const typed = { ...row, name: "Moon", grade: "font|6A", tags: "slab, jump" };
  assert.deepEqual(handRouteOf(typed, "a"), {
    id: "a", colour: "red", name: "Moon", grade_system_id: "font", grade: "6A", setter: "", tags: ["slab", "jump"], strip_on: null, line_id: null,
  });
});

test("a new row hangs on the line that its holds show, a known route on its own", () => {
  const on = { ...line(3), line_id: "seven" };
  const [fresh] = rowsOf([on], [], []);
  assert.equal(entriesOf([fresh])[0].line_id, "seven");
  const [known] = rowsOf([{ ...on, route_id: "a" }], [route("a", { line: { id: "eight", label: "8" } })], []);
  assert.equal(entriesOf([known])[0].line_id, "eight");
  // Rows that an older version of the app stored know no lines.
  const { rope, ...older } = fresh;
  assert.equal(rope, "seven");
  assert.equal(entriesOf(rowsOf([on], [], [older]))[0].line_id, null);
});

test("a grade that was signed off meanwhile is not overwritten by the review", () => {
  const [row] = rowsOf([line(3)], [], []);
  const listed = { ...row, name: "Moon", grade: "font|6A", same: "a" };
  const facts = { name: "Moon", grade: "6A", grade_system_id: "font" };
  const [read] = rowsOf([line(3)], [route("a", facts)], [listed]);
  assert.equal(read.grade, "font|6A");
  const [signed] = rowsOf([line(3)], [route("a", { ...facts, grade: "6B" })], [read]);
  assert.equal(signed.grade, "font|6B");
  assert.equal(entriesOf([signed])[0].grade, "6B");
  // What a setter typed after that stays.
  const [kept] = rowsOf([line(3)], [route("a", { ...facts, grade: "6B" })], [{ ...signed, grade: "font|7A", name: "Sun" }]);
  assert.deepEqual([kept.grade, kept.name], ["font|7A", "Sun"]);
});

test("the choice of another route fills in its facts, unless others were typed", () => {
  const [one, other] = [route("a", { name: "Moon", setter: "Jana" }), route("b", { name: "Sun", setter: "Petr" })];
  const [row] = rowsOf([line(3, "a")], [one, other], []);
  const typed = { ...row, setter: "Eva" };
  const now = identified(typed, other);
  assert.deepEqual([now.same, now.name, now.setter], ["b", "Sun", "Eva"]);
  const none = identified(now, undefined);
  assert.deepEqual([none.same, none.name, none.setter], ["", "", "Eva"]);
});

test("rows that were kept by an earlier version of the app are read", () => {
  const { known, ...row } = rowsOf([line(3)], [], [])[0];
  assert.ok(known);
  const [read] = rowsOf([line(3)], [route("a", { name: "Sun" })], [{ ...row, same: "a", name: "Moon" }]);
  assert.equal(read.name, "Moon");
});
