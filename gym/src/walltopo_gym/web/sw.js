const SHELL = ["/assets/Account-CSj3ns_0.js","/assets/Act-BNP6C1MM.js","/assets/Act-lQK3Vr64.css","/assets/Editing-BGiEPO76.js","/assets/Editing-BPW6ei06.css","/assets/Embedded-BP6Owinv.css","/assets/Embedded-BvtEDsBw.js","/assets/Field-Dznul8GC.js","/assets/Form-CIpjAUJg.js","/assets/GymFields-Dwk30eEa.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-BaGf0WdH.js","/assets/GymSettings-B9xeWqDY.js","/assets/GymSettings-DtdFeEdR.css","/assets/Invitation-B80GCGcH.js","/assets/NewGym-CFMvFKC3.js","/assets/NewPassword-Dalero6h.js","/assets/ScanPage-CSN7mRFf.css","/assets/ScanPage-CY9Hc_pW.js","/assets/SignIn-D3KnxeXd.js","/assets/SignUp-D1IoZ0Zt.js","/assets/Versions-BnkG8heU.css","/assets/Versions-DTyMgZiF.js","/assets/Wall3D-JDl53coD.css","/assets/Wall3D-TBWPy6eS.js","/assets/WallPage-CGsqDre3.js","/assets/WallPage-DbuJhSO9.css","/assets/colours-0KP05N4q.js","/assets/cs-w5BxlO4K.js","/assets/de-BuPUwjS5.js","/assets/en-DdefpTeL.js","/assets/fr-BV88H1K6.js","/assets/index-BC4rjcWD.js","/assets/index-DZi42K0r.css","/assets/roles-CjEB2poW.js","/assets/routes-DQS7rSjJ.css","/assets/routes-DR8rB9Ec.js","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "f618ef8d64fb";
// Above this the build writes SHELL, the app's own files, and VERSION, a name for them.
// The shell opens without reception; what it shows still comes from the server.

const CACHE = `shell-${VERSION}`;

self.addEventListener("install", (event) => {
  event.waitUntil(caches.open(CACHE).then((cache) => cache.addAll(["/", ...SHELL])));
  self.skipWaiting();
});

self.addEventListener("activate", (event) => {
  const drop = (names) => Promise.all(names.filter((name) => name !== CACHE).map((name) => caches.delete(name)));
  event.waitUntil(caches.keys().then(drop));
  self.clients.claim();
});

self.addEventListener("fetch", (event) => {
  const { request } = event;
  const { pathname, origin } = new URL(request.url);
  if (request.method !== "GET" || origin !== location.origin) return;
  if (request.mode === "navigate") {
    if (!pathname.startsWith("/api/")) event.respondWith(fetch(request).catch(() => caches.match("/")));
  } else if (SHELL.includes(pathname)) {
    event.respondWith(caches.match(request).then((kept) => kept ?? fetch(request)));
  }
});
