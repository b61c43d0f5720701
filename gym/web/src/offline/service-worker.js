// Above this the build writes SHELL, the app's own files, and VERSION, a name for them.
//
// The app opens from what is kept; files that never change come from what is kept; answers of the
// server come from the server, or where it cannot be reached from what it said last.

import { send } from "../outbox/send";
import { isPortal } from "./portal";
import "./shown";

const APP_CACHE = `shell-${VERSION}`;
const FILES = "files";
const ANSWERS = "answers";
const MAX_BYTES = 150e6;
const MAX_ANSWERS = 400;
const PATIENCE_MS = 4000;
const NOT_THE_APP = /^\/(api|embed|health|mcp|metrics|oembed|ready|\.well-known)(\/|$)/;
// Streams, and what is too much or too private to lie about.
const NOT_KEPT = /\/operator\/|\/(events|editor\/.*|me\/(apps|connected-apps|data|tokens)|clips\/[^/]+\/film|[^/]+\.csv|record\.json)$/;

self.addEventListener("install", (event) => {
  event.waitUntil(fill());
  self.skipWaiting();
});

async function fill() {
  const cache = await caches.open(APP_CACHE);
  await cache.addAll([new Request("/", { cache: "reload" }), ...SHELL]);
  await keepViewer(cache).catch(() => undefined); // it comes when a wall is shown
}

/** The page says where its viewer of walls is. */
async function keepViewer(cache) {
  const page = await (await cache.match("/")).text();
  const address = /name="wall-viewer" content="([^"]+)"/.exec(page)?.[1];
  if (address) await cache.add(address);
  return address && cache.match(address);
}

self.addEventListener("activate", (event) => {
  event.waitUntil(tidy());
  self.clients.claim();
});

/** A page that is open still is the version before: its cache stays until the next one. */
async function tidy() {
  const earlier = (await caches.keys()).filter((name) => name.startsWith("shell-") && name !== APP_CACHE);
  await Promise.all(earlier.slice(0, -1).map((name) => caches.delete(name)));
}

self.addEventListener("sync", (event) => {
  if (event.tag !== "outbox") return;
  // A promise that fails is what lets the browser try again.
  event.waitUntil(send().then((outcome) => {
    if (outcome === "later") throw new Error("not yet");
  }));
});

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const { pathname, origin, search } = new URL(request.url);
  if (request.method !== "GET" || origin !== location.origin || request.cache === "no-store") return;
  if (request.mode === "navigate") {
    if (!NOT_THE_APP.test(pathname)) event.respondWith(caches.match("/").then((kept) => kept ?? fetch(request)));
  } else if (pathname.startsWith("/assets/viewer-")) event.respondWith(viewer(request));
  else if (pathname.startsWith("/assets/") || SHELL.includes(pathname)) {
    event.respondWith(caches.match(request).then((kept) => kept ?? fetch(request)));
  } else if (/\/files\/|\/picture$/.test(pathname) && pathname.startsWith("/api/")) {
    // A picture without its version in the address may become another.
    event.respondWith(pathname.includes("/files/") || search ? file(event) : fetch(request));
  } else if (pathname.startsWith("/api/") && !NOT_KEPT.test(pathname)) event.respondWith(answer(event));
});

/** After an upgrade of the server the page that is kept may name a viewer that is no more. */
async function viewer(request) {
  const kept = (await caches.match(request)) ?? (await fetch(request));
  if (kept.status !== 404) return kept;
  const cache = await caches.open(APP_CACHE);
  await cache.add(new Request("/", { cache: "reload" }));
  return (await keepViewer(cache)) ?? kept;
}

async function file(event) {
  const cache = await caches.open(FILES);
  const kept = await cache.match(event.request);
  if (kept) return kept;
  const came = await fetch(event.request);
  // A picture has its version in its address.
  const isFixed = /immutable/.test(came.headers.get("cache-control") ?? "") || new URL(event.request.url).pathname.endsWith("/picture");
  if (came.status === 200 && isFixed && !isPortal(came)) {
    const copy = came.clone();
    event.waitUntil(cache.put(event.request, copy).then(() => makeRoom(cache), () => makeRoom(cache, MAX_BYTES / 2)));
  }
  return came;
}

/** The oldest go first; what the last gym needs comes again when it is looked at (`keepGym`). */
async function makeRoom(cache, maxBytes = MAX_BYTES) {
  const rows = await Promise.all((await cache.keys()).map(async (key) => {
    const kept = await cache.match(key);
    return { key, bytes: Number(kept?.headers.get("content-length") ?? 0) };
  }));
  let whole = rows.reduce((sum, { bytes }) => sum + bytes, 0);
  for (const { key, bytes } of rows) {
    if (whole <= maxBytes) return;
    await cache.delete(key);
    whole -= bytes;
  }
}

async function answer(event) {
  const { request } = event;
  const cache = await caches.open(ANSWERS);
  if (request.cache === "only-if-cached") return (await cache.match(request)) ?? new Response(null, { status: 204 });
  const kept = await cache.match(request);
  const coming = fetch(request).then((came) => {
    if (kept && isPortal(came)) return kept;
    event.waitUntil(note(cache, request, came.clone()));
    return came;
  });
  if (!kept) return coming;
  const late = new Promise((resolve) => setTimeout(resolve, PATIENCE_MS, kept));
  return Promise.race([coming.catch(() => kept), late]);
}

async function note(cache, request, came) {
  // Who may no longer see it shall not find it here.
  if ([401, 403, 404].includes(came.status)) await cache.delete(request);
  if (came.status !== 200 || !/json/.test(came.headers.get("content-type") ?? "")) return;
  const headers = new Headers(came.headers);
  headers.set("x-walltopo-kept", new Date().toISOString());
  await cache.put(request, new Response(await came.blob(), { headers }));
  const keys = await cache.keys();
  await Promise.all(keys.slice(0, Math.max(0, keys.length - MAX_ANSWERS)).map((key) => cache.delete(key)));
}
