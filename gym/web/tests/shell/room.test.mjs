import { expect, test } from "vitest";
import { roomFiles, sceneViewerLink } from "../../src/walls/room";

test("a version has both files or none", () => {
  const files = { "page/ar.usdz": "/u", "page/ar.glb": "/g", "index.html": "/i" };
  expect(roomFiles(files)).toEqual({ usdz: "/u", glb: "/g" });
  expect(roomFiles({ "page/ar.usdz": "/u" })).toBeNull();
});

test("a name cannot leave its place in the link", () => {
  const link = sceneViewerLink("https://gym.example/a b.glb", "Cave;end;#Intent&file=x", "https://gym.example/g/a?b=c;d");
  const [head, tail, ...rest] = link.split("#Intent;");
  expect(rest).toEqual([]);
  const query = new URLSearchParams(head.split("?")[1]);
  expect(query.get("file")).toBe("https://gym.example/a b.glb");
  expect(query.get("title")).toBe("Cave;end;#Intent&file=x");
  expect(tail.split(";")).toEqual([
    "scheme=https", "package=com.google.android.googlequicksearchbox", "action=android.intent.action.VIEW",
    `S.browser_fallback_url=${encodeURIComponent("https://gym.example/g/a?b=c;d")}`, "end", "",
  ]);
});
