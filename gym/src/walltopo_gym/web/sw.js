const SHELL = ["/assets/Account-Dzv6wun0.js","/assets/Act-CdSvIL0T.js","/assets/Act-lQK3Vr64.css","/assets/Embedded-BP6Owinv.css","/assets/Embedded-BWaKFqek.js","/assets/Field-BMuJvjEo.js","/assets/Form-D2zk_Vlq.js","/assets/GymFields-BcXml-NI.js","/assets/GymPage-BHLaD_T8.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymSettings-BjICHaq8.css","/assets/GymSettings-qk5Ym5fj.js","/assets/Invitation-DKYrWS2q.js","/assets/NewGym-WKmx_-tV.js","/assets/NewPassword-D697Z0Ot.js","/assets/ScanPage-50Gd7o-s.js","/assets/ScanPage-C2yclEKB.css","/assets/SignIn-DOQDlQEm.js","/assets/SignUp-4v3rb28A.js","/assets/Versions-BnkG8heU.css","/assets/Versions-Dx7tqsuf.js","/assets/Wall3D-BLb63QoX.js","/assets/Wall3D-SBDtB75S.css","/assets/WallPage-BfWa25iG.js","/assets/WallPage-DbuJhSO9.css","/assets/colours-D3wrtvv2.js","/assets/cs-Ctxx6T7G.js","/assets/de-8pvyLdDZ.js","/assets/en-BmdDwE2J.js","/assets/fr--fAKZTSd.js","/assets/index-BMdpZ50J.js","/assets/index-DDf_Ep1m.css","/assets/roles-CjEB2poW.js","/assets/routes-D5jzOBXj.js","/assets/routes-DQS7rSjJ.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "dd052ee084ef";
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
