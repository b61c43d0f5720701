// The viewer's words: those of the terminal and of the report, which are in the file that WALLTOPO_WORDS names.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "vitest";
import { speak } from "../../src/languages";
import { lean } from "../../src/data/steepness";
import { steepness, wallFacts } from "../../src/languages/format";
import { swatch } from "../../src/panels/swatch";

test("page, terminal and report use the same words", () => {
  const words = JSON.parse(readFileSync(process.env.WALLTOPO_WORDS, "utf8"));
  for (const [degrees, text] of words.steepness) {
    assert.equal(steepness(degrees), text);
    assert.ok(text.includes(lean(degrees)), `the filter calls ${degrees} ${lean(degrees)}, the card ${text}`);
  }
  for (const [routes, holds, volumes, text] of words.counts) {
    const rows = [...Array(holds + volumes).keys()].map((id) => [id, { class: id < holds ? "hold" : "volume" }]);
    const tables = { holds: new Map(rows), routes: new Map([...Array(routes).keys()].map((id) => [id, {}])) };
    assert.equal(wallFacts(tables), text.replaceAll(", ", " · "));
  }
  for (const code of ["de", "cs", "fr"]) {
    const { reasons, doubts, notes, problems } = speak([code]);
    const all = (known, said, of) => assert.deepEqual(said.filter((key) => !known[key]), [], `${code}: ${of}`);
    all(reasons, words.reasons, "why something is left out");
    all(doubts, words.doubts, "why a start or top is doubtful");
    all(problems, words.problems, "what the server refuses");
    const braces = (rows) => Object.entries(rows).map(([key, said]) => [key, said.split("{}").length]).sort();
    assert.deepEqual(braces(notes), braces(words.notes), `${code}: why an edit does nothing`);
  }
});

test("a route is drawn in the colour that it is given", () => {
  const hold = (id, colour, colour_rgb) => [id, { id, colour, colour_rgb }];
  const holds = new Map([hold(1, "green", [40, 150, 60]), hold(2, "green", [42, 150, 60]), hold(3, "red", [200, 0, 9])]);
  const tables = { holds };
  assert.equal(swatch({ holds: [1, 2], colour: "green" }, tables), "rgb(42, 150, 60)");
  assert.equal(swatch({ holds: [1, 2], colour: "red" }, tables), "rgb(200, 0, 9)");
  assert.equal(swatch({ holds: [1, 2], colour: "pink" }, tables), "rgb(230, 80, 145)");
});
