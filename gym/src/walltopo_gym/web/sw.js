const SHELL = ["/assets/Account-BRrMIM4h.js","/assets/Act-CECnUXO6.js","/assets/Act-lQK3Vr64.css","/assets/Editing-BPW6ei06.css","/assets/Editing-CVUSg2py.js","/assets/Embedded-BP6Owinv.css","/assets/Embedded-D5BnaZGq.js","/assets/Field-BhT92N10.js","/assets/Form-gnmjqA9-.js","/assets/GymFields-CncEnKNA.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-CeqbZcG1.js","/assets/GymSettings-BQtZBoDh.js","/assets/GymSettings-BjICHaq8.css","/assets/Invitation-BGoKGnyl.js","/assets/NewGym-JlEMs1JS.js","/assets/NewPassword-DeOtFpdB.js","/assets/ScanPage-C6jYEgRU.css","/assets/ScanPage-Cz3kSoxd.js","/assets/SignIn-BhtKZ7Et.js","/assets/SignUp-DezUFdT-.js","/assets/Versions-BnkG8heU.css","/assets/Versions-DUMfwsw4.js","/assets/Wall3D-BRAE9TZi.js","/assets/Wall3D-JDl53coD.css","/assets/WallPage-DbuJhSO9.css","/assets/WallPage-WWHyH5ya.js","/assets/colours-CIye4KdA.js","/assets/cs-w5BxlO4K.js","/assets/de-BuPUwjS5.js","/assets/en-DdefpTeL.js","/assets/fr-BV88H1K6.js","/assets/index-DDf_Ep1m.css","/assets/index-DJMrJUtT.js","/assets/roles-CjEB2poW.js","/assets/routes-DBriwdRz.js","/assets/routes-DQS7rSjJ.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "acf9b6ca34c8";
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
