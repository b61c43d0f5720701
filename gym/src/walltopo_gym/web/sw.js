const SHELL = ["/assets/Account-C_2eu7Mv.js","/assets/Act-B8cdvuuA.js","/assets/Act-lQK3Vr64.css","/assets/Embedded-BP6Owinv.css","/assets/Embedded-Cfdd0K1K.js","/assets/Field-CH9roVBb.js","/assets/Form-CYe_jS4N.js","/assets/GymFields-BlD3vWoK.js","/assets/GymPage-BYrlZ0Uu.css","/assets/GymPage-Dl9Vad73.js","/assets/GymSettings-BjICHaq8.css","/assets/GymSettings-D434-av7.js","/assets/Invitation-DQR64ivN.js","/assets/NewGym-B11PSa75.js","/assets/NewPassword-DzhPDOpo.js","/assets/ScanPage-C2yclEKB.css","/assets/ScanPage-DxZ19nXJ.js","/assets/SignIn-C6sAy9kJ.js","/assets/SignUp-C3DuSe0s.js","/assets/Versions-4EJlbjGU.js","/assets/Versions-BnkG8heU.css","/assets/Wall3D-C3PeRuL7.js","/assets/Wall3D-SBDtB75S.css","/assets/WallPage-DbuJhSO9.css","/assets/WallPage-G1dsc90f.js","/assets/colours-DPfLfhBJ.js","/assets/cs-CbWtVKMg.js","/assets/de-C0uB1ldG.js","/assets/en-DEqMPj-a.js","/assets/fr-DcDm26t5.js","/assets/index-CBb2HzJD.js","/assets/index-DDf_Ep1m.css","/assets/roles-CjEB2poW.js","/assets/routes-CdMVBovn.js","/assets/routes-DQS7rSjJ.css","/assets/share-CWU7Scpv.js","/assets/validate-routes-CgbRa8fT.js"];
const VERSION = "af4fb2b93550";
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
