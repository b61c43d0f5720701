const SHELL = ["/assets/Account-Cwu6yzay.js","/assets/Act-2WOutpQ1.js","/assets/Act-CnHKOvgj.css","/assets/Embedded-CTr24J21.js","/assets/Embedded-D9kDNxDv.css","/assets/Field-DaMw073e.js","/assets/Form-CByOR_jE.js","/assets/GymFields-yIwtJrD2.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-CNUighCX.js","/assets/GymSettings-BjICHaq8.css","/assets/GymSettings-fvo6B72C.js","/assets/Invitation-D0dZpxnr.js","/assets/NewGym-OARt3smG.js","/assets/NewPassword-CniGajZL.js","/assets/ScanPage-BD_O3mqm.js","/assets/ScanPage-VLiqfZHX.css","/assets/SignIn-CWYBNWrr.js","/assets/SignUp-BGv97Pwf.js","/assets/Versions-BnkG8heU.css","/assets/Versions-Csqb4R2y.js","/assets/Wall3D-BRX1gsQq.js","/assets/Wall3D-CBARgf_5.css","/assets/WallPage-CjmjADq3.js","/assets/WallPage-DbuJhSO9.css","/assets/colours-BCMWCUJY.js","/assets/cs-CbWtVKMg.js","/assets/de-C0uB1ldG.js","/assets/en-DEqMPj-a.js","/assets/fr-DcDm26t5.js","/assets/index-DDf_Ep1m.css","/assets/index-DLRgiOfw.js","/assets/roles-CjEB2poW.js","/assets/routes-B4caEHD8.js","/assets/routes-BNKTl5xA.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "79dc67e35e54";
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
