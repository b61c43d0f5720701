// What a browser hands over when somebody drops files and folders.

import { expect, test } from "vitest";
import { droppedFiles } from "../../src/scans/dropped.ts";

const file = (name, readable = true) => ({
  name, isFile: true,
  file: (done, failed) => (readable ? done({ name }) : failed(new Error("gone"))),
});

/** A folder whose reader gives two entries at a time, as browsers give a hundred. */
function folder(name, ...inside) {
  return { name, isFile: false, createReader: () => {
    const left = [...inside];
    return { readEntries: (done) => done(left.splice(0, 2)) };
  } };
}

const drop = (...entries) => ({ items: entries.map((entry) => ({ webkitGetAsEntry: () => entry })), files: [] });
const names = async (data) => (await droppedFiles(data)).map(({ name }) => name);

test("folders are walked, whatever a browser gives at a time", async () => {
  const photos = [1, 2, 3, 4, 5].map((number) => file(`${number}.jpg`));
  expect(await names(drop(file("a.jpg"), folder("wall", ...photos, folder("more", file("b.jpg")))))).toEqual([
    "a.jpg", "1.jpg", "2.jpg", "3.jpg", "4.jpg", "5.jpg", "b.jpg",
  ]);
});

test("hidden files, and files that are gone, are left out", async () => {
  expect(await names(drop(folder("wall", file(".DS_Store"), file("a.jpg"), file("b.jpg", false))))).toEqual(["a.jpg"]);
});

test("without entries the plain files are taken", async () => {
  expect(await names({ items: [{ webkitGetAsEntry: () => null }], files: [{ name: "a.jpg" }] })).toEqual(["a.jpg"]);
  expect(await names(null)).toEqual([]);
});
