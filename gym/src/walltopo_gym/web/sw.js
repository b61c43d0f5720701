const SHELL = ["/assets/Account-DRUucgvR.js","/assets/Act-CPS1VTqC.js","/assets/Act-lQK3Vr64.css","/assets/Embedded-BP6Owinv.css","/assets/Embedded-ChRea2le.js","/assets/Field-CWiECuUO.js","/assets/Form-CGLloZDR.js","/assets/GymFields-FL7N-xtv.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-lZAYfL68.js","/assets/GymSettings-BjICHaq8.css","/assets/GymSettings-QZZJHLQR.js","/assets/Invitation-DDfZFZGe.js","/assets/NewGym-k-YW4SvX.js","/assets/NewPassword-D52_mCEe.js","/assets/ScanPage-C2yclEKB.css","/assets/ScanPage-sqbhc898.js","/assets/SignIn-DfYw-SFj.js","/assets/SignUp-DoLxR_ky.js","/assets/Versions-BnkG8heU.css","/assets/Versions-MTc01TtH.js","/assets/Wall3D-BB8x38bw.js","/assets/Wall3D-SBDtB75S.css","/assets/WallPage-DbuJhSO9.css","/assets/WallPage-Dyq2dAKj.js","/assets/colours-zZo_dc4A.js","/assets/cs-Ctxx6T7G.js","/assets/de-8pvyLdDZ.js","/assets/en-BmdDwE2J.js","/assets/fr--fAKZTSd.js","/assets/index-B2ub1wU_.js","/assets/index-DDf_Ep1m.css","/assets/roles-CjEB2poW.js","/assets/routes-CGo9gcRU.js","/assets/routes-DQS7rSjJ.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "58ac54c444ec";
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
